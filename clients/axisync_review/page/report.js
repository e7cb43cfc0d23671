"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const review = data.review;
const $ = (id) => document.getElementById(id);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function element(tag, options = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(options)) {
    if (key === "class") node.className = value;
    else if (key === "style") node.style.cssText = value;
    else if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else node.setAttribute(key, value);
  }
  for (const child of children) if (child !== null && child !== undefined) node.append(child);
  return node;
}

const number = (value, digits = 3) =>
  value === null || value === undefined ? "" : value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });
const short = (value) => {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(1);
  return String(Number(value.toPrecision(4)));
};
function span(seconds) {
  if (seconds < 180) return [number(seconds, seconds < 60 ? 2 : 1), "s"];
  const hours = Math.floor(seconds / 3600), minutes = Math.floor(seconds / 60) % 60;
  return hours ? [`${hours}:${String(minutes).padStart(2, "0")}`, "h"] : [`${minutes}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`, "min"];
}

// --- theme ----------------------------------------------------------------------------------------------------------

const dark = matchMedia("(prefers-color-scheme: dark)");
function setTheme(name) { document.documentElement.dataset.theme = name; redraw(); }
$("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
document.documentElement.dataset.theme = (location.hash.match(/theme=(dark|light)/) || [])[1] || (dark.matches ? "dark" : "light");
dark.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));

// --- words and tables -----------------------------------------------------------------------------------------------

function table(headings, rows, click) {
  const head = element("tr", {}, ...headings.map(([text, kind]) => element("th", { class: kind || "" }, text)));
  const body = element("tbody");
  rows.forEach((cells, index) => {
    const row = element("tr", click ? { class: "link", onclick: () => click(index) } : {});
    cells.forEach((cell, column) => row.append(element("td", { class: headings[column][1] || "" }, cell)));
    body.append(row);
  });
  return element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), body));
}

const tag = (text, kind) => element("span", { class: `tag ${kind}` }, text);
const KINDS = { succeeded: "good", stopped: "warn", held: "warn", failed: "bad", executing: "plain", warning: "warn", error: "bad", info: "plain" };

function showVerdict() {
  const sentence = review.verdict.replace(/^(good|NOT GOOD): /, "");
  const name = review.files.map((file) => file.path.split("/").pop()).join(", ");
  const began = review.began ? review.began.replace("T", " ").replace(/\+00:00$/, " UTC") : "at an unknown time";
  document.title = `${review.good ? "good" : "not good"} · ${name}`;
  const troubled = review.incidents.some((one) => one.kind === "fault" || one.kind === "process");
  $("verdict").append(element("div", { class: `verdict ${review.good ? (troubled ? "warn" : "good") : "bad"}` },
    element("div", { class: "sign" }, review.good ? (troubled ? "!" : "✓") : "✕"),
    element("div", {},
      element("div", { class: "head" }, sentence.charAt(0).toUpperCase() + sentence.slice(1)),
      element("div", { class: "sub" }, `${name} · cell ${review.cell} · began ${began} · axisync ${review.versions.axisync || "?"}`))));
}

function showFigures() {
  const add = (name, value, unit, kind = "") => $("figures").append(element("div", { class: `figure ${kind}` },
    element("div", { class: "value" }, value, unit ? element("small", {}, ` ${unit}`) : null), element("div", { class: "name" }, name)));
  const late = review.lateness, moves = data.counts.moves;
  const done = review.moves.filter((move) => move.status === "succeeded").length;
  const peak = Math.max(0, ...review.axes.flatMap((axis) => ["velocity", "acceleration", "jerk", "stop_acceleration", "stop_jerk"].map((key) => axis[key].share)));
  const error = review.axes.reduce((a, b) => (b.following_error_share > a.following_error_share ? b : a), review.axes[0]);
  add("length", ...span(review.duration_s));
  add("ticks missing", review.missing_ticks.toLocaleString("en"), `of ${review.ticks.toLocaleString("en")}`, review.missing_ticks ? "bad" : "");
  add(moves === 1 ? "move arrived" : "moves arrived", moves > review.moves.length ? `${moves}` : `${done}`, moves > review.moves.length ? "in all" : `of ${moves}`, done < review.moves.length ? "warn" : "");
  add("highest use of a limit", number(100 * peak, 1), "%", peak > 1.00001 ? "bad" : "");
  add(`largest following error, ${number(100 * error.following_error_share, 0)} % of its window`, number(error.following_error_peak * 180 / Math.PI, 3), "deg", error.following_error_share > 1 ? "bad" : "");
  add("lateness of 99 % of ticks, at most", short(Number(late.p99_us.toPrecision(3))), "µs");
  add(late.skipped ? `ticks skipped, at most ${late.skipped_in_a_row} in a row` : "ticks skipped", late.skipped.toLocaleString("en"), "", late.skipped ? "warn" : "");
}

function showProblems() {
  const list = element("ul", { class: "notes" });
  for (const problem of review.problems) list.append(element("li", { class: "bad" }, (problem.t_s === null ? "" : `${number(problem.t_s)} s: `) + problem.message));
  for (const note of review.notes) list.append(element("li", {}, note));
  if (list.children.length) $("problems").append(list); else $("problems").remove();
}

function showMoves() {
  if (!review.moves.length) return $("moves").append(element("p", { class: "hint" }, "Nothing moved."));
  const limited = review.moves.some((move) => move.limiting);
  const rows = review.moves.map((move) => [
    move.move_id || String(move.plan_id), move.group, move.kind, move.user || "", number(move.begin_s), number(move.planned_s), number(move.played_s), ...(limited ? [move.limiting || ""] : []),
    element("span", {}, tag(move.status, KINDS[move.status] || "plain"), move.reason ? ` ${move.reason}` : "")]);
  $("moves").append(table([["move"], ["group"], ["kind"], ["asked by"], ["began, s", "number"], ["planned, s", "number"], ["took, s", "number"], ...(limited ? [["limited by"]] : []), ["result", "words"]], rows,
    (index) => { const move = review.moves[index]; zoomTo(move.begin_s - 0.3, move.begin_s + (move.played_s || 1) + 0.3); $("curves-section").scrollIntoView({ behavior: "smooth" }); }));
  const more = data.counts.moves - review.moves.length;
  if (more > 0) $("moves").append(element("p", { class: "hint", style: "margin-top:8px" }, `The first ${review.moves.length} of ${data.counts.moves}; axisync review --json has all.`));
}

function meter(use) {
  if (!use.peak) return element("span", { style: "color:var(--soft)" }, "–");
  const share = 100 * use.share;
  return element("div", { class: `meter${use.share > 1.00001 ? " over" : ""}` },
    element("i", {}, element("b", { style: `width:${Math.min(100, share)}%` })), element("span", {}, `${number(share, 1)} %`));
}

function showAxes() {
  const stops = review.axes.some((axis) => axis.stop_acceleration.peak || axis.stop_jerk.peak);
  const rows = review.axes.map((axis) => [axis.axis, meter(axis.velocity), meter(axis.acceleration), meter(axis.jerk),
    ...(stops ? [meter(axis.stop_acceleration), meter(axis.stop_jerk)] : []),
    number(axis.following_error_rms * 180e3 / Math.PI, 1), meter({ peak: axis.following_error_peak, share: axis.following_error_share })]);
  $("axes").append(table([["axis"], ["velocity"], ["acceleration"], ["jerk"], ...(stops ? [["stop: acceleration"], ["stop: jerk"]] : []), ["error rms, mdeg", "number"], ["error peak, of window"]], rows));
}

function showIncidents() {
  if (!review.incidents.length) return $("incidents").remove();
  $("incidents").append(element("h2", {}, "Stops, faults and refusals"), element("p", { class: "hint" }, "axisync why prints the evidence for each."),
    table([["at, s", "number"], ["tick", "number"], ["kind"], ["what", "words"]], review.incidents.map((one) => [
      number(one.t_s), one.tick === null ? "" : String(one.tick), tag(one.kind, one.kind === "fault" || one.kind === "process" ? "bad" : "warn"), one.message]),
    (index) => { const at = review.incidents[index].t_s; zoomTo(at - 1, at + 1); $("curves-section").scrollIntoView({ behavior: "smooth" }); }));
}

function showEvents() {
  if (!review.events.length) return $("events").append(element("p", { class: "hint" }, "None."));
  $("events").append(table([["at, s", "number"], ["from"], ["kind"], ["what", "words"]], review.events.map((event) => [
    number(event.t_s), event.source, tag(event.kind.replaceAll("_", " "), KINDS[event.severity]), event.message])));
  if (data.counts.events > review.events.length) $("events").append(element("p", { class: "hint", style: "margin-top:8px" }, `${review.events.length} of ${data.counts.events}.`));
}

function showFiles() {
  $("files").append(table([["file", "words"], ["MB", "number"], ["state", "words"]], review.files.map((file) => [file.path, number(file.bytes / 1e6, 2), file.complete ? "whole" : file.damage])));
  const buses = review.buses.filter((bus) => bus.planned_load !== null || bus.logged_load !== null).map((bus) =>
    `${bus.bus} ${bus.logged_load === null ? "" : `${number(100 * bus.logged_load, 0)} % at most as logged, `}${number(100 * bus.planned_load, 0)} % by its cell file, at worst`);
  $("files").append(element("p", { class: "hint", style: "margin-top:10px" }, `Bus load: ${buses.join("; ")}. ` + Object.entries(review.versions).map(([name, version]) => `${name} ${version}`).join(", ")));
}

// --- data of curves -------------------------------------------------------------------------------------------------

async function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

async function levels(text, count) {
  const raw = new Uint16Array(await unpack(text));
  const rows = [];
  for (let begin = 0; begin < raw.length; begin += count) {
    const row = raw.subarray(begin, begin + count);
    for (let i = 1; i < count; i++) row[i] += row[i - 1];
    rows.push(row);
  }
  return rows;
}

async function load() {
  if (!data.t) return false;
  data.times = new Float64Array(await unpack(data.t));
  data.stateRows = new Uint8Array(await unpack(data.state));
  for (const curve of data.curves) {
    curve.lows = await levels(curve.low, data.count);
    curve.highs = curve.high ? await levels(curve.high, data.count) : curve.lows;
    curve.low = curve.high = null;
  }
  return true;
}

// --- curves ---------------------------------------------------------------------------------------------------------

const LEFT = 62, RIGHT = 10, view = { begin: 0, end: 1, cursor: null, percent: false }, shown = new Set();
const panels = [];
const colourOf = (axis) => {
  for (const group of data.groups) { const at = group.axes.indexOf(axis); if (at >= 0) return `--c${at % 6}`; }
  return "--c0";
};
const dashedOf = (axis) => data.groups.findIndex((group) => group.axes.includes(axis)) % 2 === 1;

function makeControls() {
  const velocity = data.curves.find((one) => one.name === "velocity");
  const moved = (axis) => velocity.greatest[axis] > velocity.least[axis];
  data.axes.forEach((_, axis) => { if (moved(axis)) shown.add(axis); });
  if (!shown.size) data.groups[0].axes.forEach((axis) => shown.add(axis));
  const chips = new Map();
  const refresh = () => { chips.forEach((chip, axis) => chip.classList.toggle("off", !shown.has(axis))); redraw(); };
  for (const group of data.groups) {
    $("controls").append(element("button", { class: "chip", type: "button", title: "all of this group, or none", onclick: () => {
      const all = group.axes.every((axis) => shown.has(axis));
      group.axes.forEach((axis) => (all ? shown.delete(axis) : shown.add(axis))); refresh();
    } }, element("strong", {}, group.name)));
    for (const axis of group.axes) {
      const chip = element("button", { class: "chip", type: "button", onclick: () => { shown.has(axis) ? shown.delete(axis) : shown.add(axis); refresh(); } },
        element("span", { class: `swatch${dashedOf(axis) ? " dashed" : ""}`, style: `border-color:var(${colourOf(axis)})` }), data.axes[axis].replace(`${group.name}.`, ""));
      chips.set(axis, chip);
      $("controls").append(chip);
    }
  }
  $("controls").append(element("span", { class: "space" }));
  const choices = [["units", false], ["% of limit", true]].map(([text, percent]) => {
    const chip = element("button", { class: "chip choice", type: "button", onclick: () => { view.percent = percent; choices.forEach(([one, value]) => one.classList.toggle("on", value === percent)); redraw(); } }, text);
    chip.classList.toggle("on", percent === view.percent);
    return [chip, percent];
  });
  choices.forEach(([chip]) => $("controls").append(chip));
  $("controls").append(element("button", { class: "chip", type: "button", onclick: () => zoomTo(data.times[0], data.times[data.count - 1]) }, "all"));
  chips.forEach((chip, axis) => chip.classList.toggle("off", !shown.has(axis)));
}

function makePanels() {
  const add = (title, unit, height, draw, value) => {
    const canvas = element("canvas"), read = element("span", { class: "read" }), unitNode = element("span", { class: "unit" }, unit ? ` ${unit}` : "");
    canvas.style.height = `${height}px`;
    $("panels").append(element("div", { class: "panel" }, element("div", { class: "title" }, element("span", {}, title, unitNode), read), canvas));
    const panel = { canvas, read, draw, value, unitNode };
    panels.push(panel);
    interact(canvas);
  };
  add("states", "", 14 + 20 * data.groups.length, drawStates, readStates);
  for (const curve of data.curves) {
    const height = curve.name === "lateness" ? 92 : curve.name === "position" ? 170 : 140;
    add(curve.title, curve.unit, height, (panel) => drawCurve(panel, curve), (at) => readCurve(curve, at));
  }
}

function interact(canvas) {
  let from = null;
  const timeAt = (event) => { const box = canvas.getBoundingClientRect(); return view.begin + (view.end - view.begin) * (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT); };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const at = timeAt(event), factor = Math.exp(event.deltaY * 0.0015);
    zoomTo(at + (view.begin - at) * factor, at + (view.end - at) * factor);
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => { from = { x: event.clientX, begin: view.begin, end: view.end }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { from = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (from) {
      const moved = (from.x - event.clientX) * (from.end - from.begin) / (canvas.clientWidth - LEFT - RIGHT);
      zoomTo(from.begin + moved, from.end + moved);
    }
    view.cursor = timeAt(event);
    redraw();
  });
  canvas.addEventListener("pointerleave", () => { view.cursor = null; redraw(); });
  canvas.addEventListener("dblclick", () => zoomTo(data.times[0], data.times[data.count - 1]));
}

function zoomTo(begin, end) {
  if (!data.times) return;
  const first = data.times[0], last = Math.max(data.times[data.count - 1], first + 0.01);
  const least = Math.min(last - first, Math.max(0.02, 8 * data.bucket_s));
  let width = Math.min(last - first, Math.max(least, end - begin));
  const middle = (begin + end) / 2;
  begin = Math.max(first, Math.min(last - width, middle - width / 2));
  view.begin = begin; view.end = begin + width;
  redraw();
}

let asked = false;
function redraw() { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; drawAll(); }); } }

function surface(canvas) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "11.5px system-ui, 'DejaVu Sans', sans-serif";
  return { pen, width, height };
}

const xOf = (time, width) => LEFT + (time - view.begin) / (view.end - view.begin) * (width - LEFT - RIGHT);
function bucketAt(time) {
  let low = 0, high = data.count - 1;
  while (low < high) { const middle = (low + high + 1) >> 1; if (data.times[middle] <= time) low = middle; else high = middle - 1; }
  return low;
}

function steps(low, high, count) {
  const raw = (high - low) / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw);
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-9; value += step) found.push(Math.abs(value) < step * 1e-9 ? 0 : value);
  return found;
}

function timeAxis(pen, width, height, labels) {
  pen.strokeStyle = css("--grid"); pen.fillStyle = css("--soft"); pen.textAlign = "center"; pen.textBaseline = "alphabetic"; pen.lineWidth = 1;
  for (const time of steps(view.begin, view.end, Math.max(3, (width - LEFT) / 110))) {
    const x = Math.round(xOf(time, width)) + 0.5;
    pen.beginPath(); pen.moveTo(x, 4); pen.lineTo(x, height - (labels ? 18 : 4)); pen.stroke();
    if (labels && x > LEFT && x < width - 22) pen.fillText(`${short(Number(time.toPrecision(9)))} s`, x, height - 5);
  }
}

function cursorLine(pen, width, height) {
  for (const one of review.incidents) {
    if (one.kind === "refusal" || one.t_s < view.begin || one.t_s > view.end) continue;
    const x = xOf(one.t_s, width);
    pen.strokeStyle = css("--bad"); pen.globalAlpha = 0.55; pen.setLineDash([3, 3]);
    pen.beginPath(); pen.moveTo(x, 4); pen.lineTo(x, height - 4); pen.stroke();
    pen.setLineDash([]); pen.globalAlpha = 1;
  }
  if (view.cursor === null || view.cursor < view.begin || view.cursor > view.end) return;
  pen.strokeStyle = css("--soft"); pen.lineWidth = 1;
  const x = Math.round(xOf(view.cursor, width)) + 0.5;
  pen.beginPath(); pen.moveTo(x, 2); pen.lineTo(x, height - 2); pen.stroke();
}

const STATE_COLOURS = { disabled: "--grid", standstill: "--line", moving: "--c0", held: "--c4", stopping: "--c1", homing: "--c3", jogging: "--c2", fault: "--bad" };
function drawStates(panel) {
  const { pen, width, height } = surface(panel.canvas);
  timeAxis(pen, width, height, false);
  const first = bucketAt(view.begin), last = bucketAt(view.end);
  data.groups.forEach((group, row) => {
    const top = 5 + 20 * row, states = data.stateRows.subarray(row * data.count, (row + 1) * data.count);
    let begin = first;
    for (let i = first + 1; i <= last + 1; i++) {
      if (i <= last && states[i] === states[begin]) continue;
      const from = Math.max(LEFT, xOf(data.times[begin], width));
      const to = Math.min(width - RIGHT, i <= last ? xOf(data.times[i], width) : width - RIGHT);
      const name = data.states[states[begin]] || "?";
      pen.fillStyle = css(STATE_COLOURS[name] || "--line");
      pen.fillRect(from, top, Math.max(0.7, to - from), 15);
      if (to - from > 70) {
        pen.fillStyle = name === "disabled" || name === "standstill" ? css("--soft") : css("--on");
        pen.textAlign = "left"; pen.textBaseline = "middle"; pen.fillText(name, from + 7, top + 8);
      }
      begin = i;
    }
    pen.fillStyle = css("--soft"); pen.textAlign = "right"; pen.textBaseline = "middle"; pen.fillText(group.name, LEFT - 6, top + 8, LEFT - 8);
  });
  cursorLine(pen, width, height);
}
const readStates = (at) => `${number(data.times[at])} s`;

function scaleOf(curve, axis) {
  const span = curve.greatest[axis] - curve.least[axis], limit = view.percent && curve.limits ? 100 / curve.limits[axis] : 1;
  return { zero: curve.least[axis] * limit, step: (span > 0 ? span : 0) / 65535 * limit };
}
const axesOf = (curve) => (curve.name === "lateness" ? [0] : [...shown].sort((a, b) => a - b));

function rangeOf(curve, axes, first, last) {
  let low = Infinity, high = -Infinity;
  for (const axis of axes) {
    const { zero, step } = scaleOf(curve, axis), lows = curve.lows[axis], highs = curve.highs[axis];
    let least = 65535, most = 0;
    for (let i = first; i <= last; i++) { if (lows[i] < least) least = lows[i]; if (highs[i] > most) most = highs[i]; }
    low = Math.min(low, zero + step * least); high = Math.max(high, zero + step * most);
  }
  if (low > high) return [-1, 1];
  if (curve.name === "lateness") return [0, Math.max(1, high * 1.08)];
  const bound = (axis) => (stopped && curve.stop_limits ? curve.stop_limits[axis] : curve.limits[axis]);
  const limits = curve.limits && curve.name !== "following_error" ? axes.map((axis) => (view.percent ? 100 * bound(axis) / curve.limits[axis] : bound(axis))) : [];
  if (limits.length && Math.max(high, -low) > 0.02 * Math.max(...limits)) { const most = Math.max(...limits) * 1.12; low = Math.min(low, -most); high = Math.max(high, most); }
  if (high - low < 1e-9) { low -= 1; high += 1; }
  const margin = 0.06 * (high - low);
  return [low - margin, high + margin];
}

function drawCurve(panel, curve) {
  const { pen, width, height } = surface(panel.canvas), bottom = height - 20, top = 6;
  panel.unitNode.textContent = ` ${view.percent && curve.limits ? (curve.name === "following_error" ? "% of window" : "% of limit") : curve.unit}`;
  const axes = axesOf(curve), first = Math.max(0, bucketAt(view.begin) - 1), last = Math.min(data.count - 1, bucketAt(view.end) + 1);
  const [low, high] = rangeOf(curve, axes, first, last), yOf = (value) => bottom - (value - low) / (high - low) * (bottom - top);
  timeAxis(pen, width, height, true);
  pen.textAlign = "right"; pen.textBaseline = "middle";
  for (const value of steps(low, high, height / 34)) {
    const y = Math.round(yOf(value)) + 0.5;
    pen.strokeStyle = css(value === 0 ? "--line" : "--grid"); pen.fillStyle = css("--soft");
    pen.beginPath(); pen.moveTo(LEFT, y); pen.lineTo(width - RIGHT, y); pen.stroke();
    pen.fillText(short(Number(value.toPrecision(9))), LEFT - 7, y);
  }
  pen.save(); pen.beginPath(); pen.rect(LEFT, 0, width - LEFT - RIGHT, height - 18); pen.clip();
  if (curve.limits && curve.name !== "following_error") limitLines(pen, curve, axes, width, yOf);
  for (const axis of axes) trace(pen, curve, axis, first, last, width, yOf);
  pen.restore();
  cursorLine(pen, width, height);
}

const stopped = review.axes.some((axis) => axis.stop_acceleration.peak || axis.stop_jerk.peak);
function limitLines(pen, curve, axes, width, yOf) {
  const draw = (values, colour, dash, name) => {
    pen.strokeStyle = pen.fillStyle = css(colour); pen.globalAlpha = 0.75; pen.lineWidth = 1; pen.setLineDash(dash);
    for (const limit of new Set(values)) for (const value of [limit, -limit]) { pen.beginPath(); pen.moveTo(LEFT, yOf(value)); pen.lineTo(width - RIGHT, yOf(value)); pen.stroke(); }
    pen.setLineDash([]); pen.textAlign = "left"; pen.textBaseline = "bottom";
    const label = [name, LEFT + 5, yOf(Math.max(...values)) - 1];  // where curves mostly stand still, and not under them
    pen.lineWidth = 3; pen.strokeStyle = css("--card"); pen.strokeText(...label); pen.lineWidth = 1; pen.fillText(...label);
    pen.globalAlpha = 1;
  };
  const share = (axis, value) => (view.percent ? 100 * value / curve.limits[axis] : value);
  if (axes.length) draw(axes.map((axis) => share(axis, curve.limits[axis])), "--bad", [6, 4], "limit");
  if (axes.length && stopped && curve.stop_limits) draw(axes.map((axis) => share(axis, curve.stop_limits[axis])), "--warn", [2, 3], "stop limit");
}

function trace(pen, curve, axis, first, last, width, yOf) {
  const { zero, step } = scaleOf(curve, axis), lows = curve.lows[axis], highs = curve.highs[axis];
  pen.strokeStyle = css(curve.name === "lateness" ? "--c0" : colourOf(axis)); pen.lineWidth = curve.name === "lateness" ? 1 : 1.5; pen.lineJoin = "round";
  pen.setLineDash(curve.name !== "lateness" && dashedOf(axis) ? [5, 3] : []);
  pen.beginPath();
  const perPixel = (last - first) / (width - LEFT - RIGHT);
  let column = null, least = 0, most = 0, before = null;
  const point = (x, level) => { const y = yOf(zero + step * level); before === null ? pen.moveTo(x, y) : pen.lineTo(x, y); before = level; };
  const flush = (x) => {
    const falls = before !== null && Math.abs(before - most) < Math.abs(before - least);
    point(x, falls ? most : least);
    if (most > least) point(x, falls ? least : most);
  };
  for (let i = first; i <= last; i++) {
    const x = xOf(data.times[i], width);
    if (perPixel <= 1) { least = lows[i]; most = highs[i]; flush(x); continue; }
    const pixel = Math.floor(x);
    if (pixel === column) { least = Math.min(least, lows[i]); most = Math.max(most, highs[i]); continue; }
    if (column !== null) flush(column);
    column = pixel; least = lows[i]; most = highs[i];
  }
  if (column !== null) flush(column);
  pen.stroke(); pen.setLineDash([]);
}

function readCurve(curve, at) {
  const axes = axesOf(curve).slice(0, 7);
  return axes.map((axis) => {
    const { zero, step } = scaleOf(curve, axis), value = Math.abs(curve.lows[axis][at] * step + zero) > Math.abs(curve.highs[axis][at] * step + zero) ? curve.lows[axis][at] : curve.highs[axis][at];
    const node = element("b", { style: `color:var(${curve.name === "lateness" ? "--c0" : colourOf(axis)})` }, short(Number((value * step + zero).toFixed(4))));
    return element("span", {}, "  ", node);
  });
}

function readOut() {
  const at = view.cursor === null ? null : bucketAt(view.cursor);
  for (const panel of panels) {
    const found = at === null ? [] : panel.value(at);
    panel.read.replaceChildren(...(Array.isArray(found) ? found : [found]));
  }
}

// --- tool path ------------------------------------------------------------------------------------------------------

const eye = { turn: -0.75, tilt: 0.42, zoom: 1 };
function makePath() {
  const canvas = $("path");
  if (!data.paths || !data.paths.length) { canvas.parentElement.replaceChildren(element("p", { class: "hint", style: "margin:6px 0" }, "No arm model in the cell file, or pinocchio was not installed where this report was made.")); return; }
  let from = null;
  canvas.addEventListener("pointerdown", (event) => { from = { x: event.clientX, y: event.clientY, ...eye }; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { from = null; });
  canvas.addEventListener("pointermove", (event) => { if (from) { eye.turn = from.turn + (event.clientX - from.x) * 0.008; eye.tilt = Math.max(-1.5, Math.min(1.5, from.tilt + (event.clientY - from.y) * 0.008)); redraw(); } });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); eye.zoom = Math.max(0.3, Math.min(30, eye.zoom * Math.exp(-event.deltaY * 0.0012))); redraw(); }, { passive: false });
  for (const path of data.paths) $("path-legend").append(element("span", { style: `--dot:var(--c${path.group % 6})` }, `${data.groups[path.group].name}${path.points.length > 1 ? "" : " (stands)"}`));
}

function drawPath() {
  if (!data.paths || !data.paths.length) return;
  const { pen, width, height } = surface($("path"));
  const all = data.paths.flatMap((path) => [...path.points, data.groups[path.group].base]);
  const low = [0, 1, 2].map((i) => Math.min(...all.map((p) => p[i]))), high = [0, 1, 2].map((i) => Math.max(...all.map((p) => p[i])));
  const flat = ([x, y, z]) => {
    const right = x * Math.cos(eye.turn) - y * Math.sin(eye.turn), deep = x * Math.sin(eye.turn) + y * Math.cos(eye.turn);
    return [right, z * Math.cos(eye.tilt) + deep * Math.sin(eye.tilt)];
  };
  const flats = all.map(flat), least = [0, 1].map((i) => Math.min(...flats.map((p) => p[i]))), most = [0, 1].map((i) => Math.max(...flats.map((p) => p[i])));
  const scale = Math.min((width - 90) / Math.max(0.05, most[0] - least[0]), (height - 70) / Math.max(0.05, most[1] - least[1])) * eye.zoom;
  const project = (point) => { const [a, b] = flat(point); return [width / 2 + scale * (a - (least[0] + most[0]) / 2), height / 2 - scale * (b - (least[1] + most[1]) / 2)]; };
  const line = (points) => { pen.beginPath(); points.forEach((p, i) => { const [x, y] = project(p); i ? pen.lineTo(x, y) : pen.moveTo(x, y); }); pen.stroke(); };
  floor(pen, line, project, low, high);
  for (const path of data.paths) {
    const base = data.groups[path.group].base, colour = css(`--c${path.group % 6}`);
    pen.strokeStyle = colour; pen.lineWidth = 2; pen.lineJoin = "round"; line(path.points);
    dot(pen, project(path.points[0]), 4.5, colour, true); dot(pen, project(path.points[path.points.length - 1]), 4.5, colour, false);
    const [x, y] = project(base);
    pen.fillStyle = css("--soft"); pen.fillRect(x - 4, y - 4, 8, 8);
    const before = project(data.groups[path.group ? 0 : data.groups.length - 1].base)[0] > x;
    pen.textAlign = before ? "right" : "left"; pen.textBaseline = "middle"; pen.fillText(`base of ${data.groups[path.group].name}`, x + (before ? -8 : 8), y);
    if (view.cursor !== null && data.times) dot(pen, project(path.points[pointAt(path, bucketAt(view.cursor))]), 6, css("--bad"), false);
  }
}
function pointAt(path, bucket) {
  let at = 0;
  while (at + 1 < path.rows.length && path.rows[at + 1] <= bucket) at++;
  return at;
}
function dot(pen, [x, y], size, colour, hollow) {
  pen.beginPath(); pen.arc(x, y, size, 0, 2 * Math.PI); pen.fillStyle = hollow ? css("--card") : colour; pen.fill();
  pen.strokeStyle = colour; pen.lineWidth = 2; pen.stroke();
}
function floor(pen, line, project, low, high) {
  const step = [0.05, 0.1, 0.2, 0.5, 1, 2].find((one) => Math.max(high[0] - low[0], high[1] - low[1]) / one <= 12) || 5;
  const from = [0, 1].map((i) => Math.floor(low[i] / step) * step), to = [0, 1].map((i) => Math.ceil(high[i] / step) * step), z = Math.min(0, low[2]);
  pen.strokeStyle = css("--grid"); pen.lineWidth = 1;
  for (let x = from[0]; x <= to[0] + 1e-9; x += step) line([[x, from[1], z], [x, to[1], z]]);
  for (let y = from[1]; y <= to[1] + 1e-9; y += step) line([[from[0], y, z], [to[0], y, z]]);
  const arm = 1.2 * step;
  [["x", [arm, 0, 0], "--c1"], ["y", [0, arm, 0], "--c2"], ["z", [0, 0, arm], "--c0"]].forEach(([name, tip, colour]) => {
    pen.strokeStyle = pen.fillStyle = css(colour); pen.lineWidth = 1.6; line([[0, 0, 0], tip]);
    const [x, y] = project(tip); pen.textAlign = "center"; pen.textBaseline = "middle"; pen.fillText(name, x, y - 8);
  });
  pen.fillStyle = css("--soft"); pen.textAlign = "left"; pen.textBaseline = "alphabetic"; pen.fillText(`grid ${step} m`, 4, $("path").clientHeight - 6);
}

// --- lateness -------------------------------------------------------------------------------------------------------

function drawLateness() {
  const { pen, width, height } = surface($("lateness")), late = review.lateness, left = 58, bottom = height - 34;
  if (!late.counts.length) return;
  const edges = late.edges_us.map((edge) => Math.max(edge, 0.08)), ratio = 10 ** 0.1;
  const begin = Math.log10(edges[0]) - 0.05, end = Math.log10(edges[edges.length - 1] * ratio) + 0.1, most = Math.log10(Math.max(...late.counts)) + 0.15;
  const xAt = (value) => left + (Math.log10(value) - begin) / (end - begin) * (width - left - 8), yAt = (count) => bottom - (Math.log10(count) + 0.35) / (most + 0.35) * (bottom - 10);
  pen.textBaseline = "middle"; pen.textAlign = "right";
  for (let power = 0; power <= most; power++) {
    const y = Math.round(yAt(10 ** power)) + 0.5;
    pen.strokeStyle = css("--grid"); pen.beginPath(); pen.moveTo(left, y); pen.lineTo(width - 8, y); pen.stroke();
    pen.fillStyle = css("--soft"); pen.fillText((10 ** power).toLocaleString("en"), left - 7, y);
  }
  pen.fillStyle = css("--bar");
  late.counts.forEach((count, i) => { if (count) { const x = xAt(edges[i]), next = xAt(edges[i] * ratio); pen.fillRect(x + 0.5, yAt(count), Math.max(1, next - x - 1.5), bottom - yAt(count)); } });
  pen.textAlign = "center"; pen.textBaseline = "alphabetic"; pen.fillStyle = css("--soft");
  for (let power = Math.ceil(begin); power <= end; power++) pen.fillText(short(10 ** power), xAt(10 ** power), bottom + 15);
  pen.fillText("µs after the tick's instant", (left + width) / 2, height - 4);
  let last = -99, row = 0;  // names that would run into each other are set below each other
  for (const [name, value] of [["p50", late.p50_us], ["p99", late.p99_us], ["p99.9", late.p999_us], ["max", late.max_us]]) {
    if (value < 10 ** begin) continue;
    const x = Math.min(width - 9, xAt(value));
    row = x - last < 36 ? 1 - row : 0; last = x;
    pen.strokeStyle = css("--c1"); pen.setLineDash([4, 3]); pen.beginPath(); pen.moveTo(x, 22 + 12 * row); pen.lineTo(x, bottom); pen.stroke(); pen.setLineDash([]);
    pen.fillStyle = css("--c1"); pen.fillText(name, Math.min(x, width - 16), 14 + 12 * row);
  }
}

// --- all ------------------------------------------------------------------------------------------------------------

function drawAll() {
  if (data.times) { for (const panel of panels) panel.draw(panel); readOut(); }
  drawPath();
  drawLateness();
}

async function main() {
  showVerdict(); showFigures(); showProblems(); showMoves(); showAxes(); showIncidents(); showEvents(); showFiles();
  const late = review.lateness;
  $("lateness-words").textContent = `${late.ticks.toLocaleString("en")} ticks, both scales logarithmic; the latest was ${short(late.max_us)} µs, at tick ${late.max_tick}.`
    + (late.skipped ? ` The ${late.skipped.toLocaleString("en")} skipped ones are left out.` : "");
  makePath();
  try {
    if (await load()) {
      $("bucket").textContent = data.bucket_s ? `; a bucket is ${short(Number((1e3 * data.bucket_s).toFixed(3)))} ms` : "";
      view.begin = data.times[0]; view.end = Math.max(data.times[data.count - 1], view.begin + 0.01);
      makeControls(); makePanels();
      const zoom = location.hash.match(/from=([-\d.]+)&to=([-\d.]+)/);
      if (zoom) zoomTo(Number(zoom[1]), Number(zoom[2]));
      else if (review.moves.length) zoomTo(review.moves[0].begin_s - 0.5, Math.max(...review.moves.map((move) => move.begin_s + (move.played_s || 0))) + 0.5);
    } else $("curves-section").remove();
  } catch (error) {
    $("panels").replaceChildren(element("p", { class: "hint" }, `This browser cannot show the curves (${error.name}); a newer one can.`));
  }
  window.addEventListener("resize", redraw);
  redraw();
}
main();
