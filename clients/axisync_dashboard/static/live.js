// Fills in what the daemon sends, greys it when it is old, sends stops and jogs. One socket a page, 20 frames a second.
(() => {
  const STALE_MS = 400;
  const HOLD_MS = 600;
  const JOG_MS = 100;
  const ACK_MS = 200;
  const EVENTS = 300;
  const page = window.axisyncPage;
  const texts = {};
  const listeners = new Set();
  let socket = null;
  let latest = null;
  let heardMs = 0;
  let ackMs = 0;
  let retryMs = 250;

  window.axisync = {
    on(listener) {
      listeners.add(listener);
      if (latest) listener(latest);
      return () => listeners.delete(listener);
    },
  };

  // --- the socket -------------------------------------------------------------------------------------------------

  function connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/live?client=${page.client}`);
    socket.onmessage = (message) => receive(JSON.parse(message.data));
    socket.onopen = () => (retryMs = 250);
    socket.onclose = () => {
      socket = null;
      setTimeout(connect, retryMs);
      retryMs = Math.min(2000, 2 * retryMs);
    };
  }

  function send(what) {
    if (!socket || socket.readyState !== WebSocket.OPEN) return false;
    socket.send(JSON.stringify(what));
    return true;
  }

  function receive(frame) {
    if (frame.stopped !== undefined) return onStopped(frame);
    if (frame.jogoff !== undefined) return endJog(false);
    if (frame.cell !== page.cell) return location.reload();
    heardMs = performance.now();
    latest = frame;
    if (frame.all) for (const key of Object.keys(texts)) delete texts[key];
    Object.assign(texts, frame.x);
    fill(frame.all ? texts : frame.x);
    if (frame.h) fillHistogram(frame.h);
    if (frame.e) addEvents(frame.e, frame.all);
    listeners.forEach((listener) => listener(frame));
    showFreshness();
    if (heardMs - ackMs > ACK_MS && send({ ack: frame.n })) ackMs = heardMs;
  }

  // --- texts ------------------------------------------------------------------------------------------------------

  function fill(some) {
    for (const element of document.querySelectorAll("[data-live]")) {
      const text = some[element.dataset.live];
      if (text === undefined || element.dataset.value === text) continue;
      element.textContent = text;
      element.dataset.value = text;
    }
    for (const element of document.querySelectorAll("[data-bar]")) {
      const text = some[element.dataset.bar];
      if (text !== undefined) element.style.width = text;
    }
  }

  function fillHistogram(counts) {
    const most = Math.max(1, ...counts);
    document.querySelectorAll("[data-bin]").forEach((bar) => {
      const count = counts[Number(bar.dataset.bin)];
      bar.style.height = count ? `${Math.max(3, (100 * Math.log1p(count)) / Math.log1p(most))}%` : "0";
      bar.title = `${count} ticks`;
    });
  }

  function addEvents(events, all) {
    const list = document.getElementById("events");
    if (!list) return;
    if (all) list.replaceChildren();
    for (const [time, severity, where, kind, message] of events) {
      const row = document.createElement("div");
      row.className = `event event-${severity}`;
      for (const text of [time, where, kind, message]) {
        const cell = document.createElement("span");
        cell.textContent = text;
        row.append(cell);
      }
      list.prepend(row);
    }
    while (list.childElementCount > EVENTS) list.lastElementChild.remove();
  }

  // --- old data ---------------------------------------------------------------------------------------------------

  function showFreshness() {
    if (!document.body) return;
    const silentMs = performance.now() - heardMs;
    const cut = silentMs > STALE_MS;
    const stale = cut || !latest || !latest.ok;
    document.body.classList.toggle("stale", stale);
    const banner = document.getElementById("banner");
    if (banner) banner.textContent = stale ? sentence(cut, silentMs) : "";
  }

  function sentence(cut, silentMs) {
    const seconds = (ms) => `${(ms / 1000).toFixed(0)} s`;
    if (!latest) return "Connecting.";
    if (cut) return `Nothing from the dashboard's server for ${seconds(silentMs)}. What is shown is old. Connecting again.`;
    const why = latest.why || "The daemon is silent.";
    const old = page.cell ? `What is shown is ${seconds(1000 * latest.age)} old. ` : "";
    return `${why[0].toUpperCase()}${why.slice(1)} ${old}Connecting again.`;
  }

  // --- stop: at once, from anywhere --------------------------------------------------------------------------------

  let stopId = 0;
  let stopTimer = 0;

  function stop() {
    stopId += 1;
    sayStop("Stopping");
    endJog(false);
    const id = stopId;
    const byPost = () =>
      fetch("/stop", { method: "POST" })
        .then((answer) => answer.json())
        .then((answer) => onStopped({ ...answer, id }))
        .catch(() => onStopped({ stopped: "Not sent: no connection", id, failed: true }));
    if (!send({ stop: id })) return byPost();
    clearTimeout(stopTimer);
    stopTimer = setTimeout(byPost, 500); // the socket may be dead without saying so; a second stop does no harm
  }

  function onStopped(answer) {
    if (answer.id !== stopId) return;
    clearTimeout(stopTimer);
    sayStop(answer.stopped, answer.failed);
    stopTimer = setTimeout(() => sayStop(""), answer.failed ? 15000 : 4000);
  }

  function sayStop(text, failed) {
    const note = document.getElementById("stop-note");
    if (!note) return;
    note.textContent = text;
    note.classList.toggle("failed", Boolean(failed));
  }

  // --- press and hold ---------------------------------------------------------------------------------------------

  let held = null;

  function beginHold(button) {
    endHold();
    if (!button || button.disabled || button.classList.contains("disabled")) return;
    button.classList.add("holding");
    held = { button, timer: setTimeout(() => confirmHold(button), HOLD_MS) };
  }

  function confirmHold(button) {
    endHold();
    button.dispatchEvent(new CustomEvent("confirmed"));
  }

  function endHold() {
    if (!held) return;
    clearTimeout(held.timer);
    held.button.classList.remove("holding");
    held = null;
  }

  // --- jog: a held pad or key refreshes; nothing else does -----------------------------------------------------------

  let jog = null;

  function beginJog(pad) {
    endJog(true);
    if (!pad || pad.disabled || pad.classList.contains("disabled")) return;
    pad.classList.add("held");
    const refresh = () => send({ jog: [Number(pad.dataset.pad), Number(pad.dataset.sign)] }) || endJog(false);
    jog = { pad, timer: setInterval(refresh, JOG_MS) };
    refresh();
  }

  function endJog(tell) {
    if (!jog) return;
    clearInterval(jog.timer);
    jog.pad.classList.remove("held");
    jog = null;
    if (tell) send({ jogend: 1 });
  }

  // --- fingers and keys -------------------------------------------------------------------------------------------

  const typing = (target) => target.matches("input, textarea, select, [contenteditable]");

  document.addEventListener("pointerdown", (event) => {
    if (event.target.closest("#stop")) return stop();
    if (event.button !== 0) return undefined;
    const pad = event.target.closest(".pad");
    if (pad) return beginJog(pad);
    return beginHold(event.target.closest(".hold"));
  }, true);

  for (const name of ["pointerup", "pointercancel"]) {
    document.addEventListener(name, () => { endHold(); endJog(true); }, true);
  }
  document.addEventListener("pointermove", (event) => {
    if (held && !held.button.contains(document.elementFromPoint(event.clientX, event.clientY))) endHold();
  }, true);

  function letGo() {
    endHold();
    endJog(true);
  }
  window.addEventListener("blur", letGo);
  window.addEventListener("pagehide", letGo);
  document.addEventListener("visibilitychange", () => document.hidden && letGo());
  document.addEventListener("contextmenu", (event) => event.target.closest(".hold, .pad, #stop") && event.preventDefault());

  document.addEventListener("keydown", (event) => {
    if (event.code === "Space") {
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) stop();
    } else if (event.code === "Enter" && event.target.closest?.(".hold")) {
      if (!event.repeat) beginHold(event.target.closest(".hold"));
    } else if (!typing(event.target) && !event.ctrlKey && !event.metaKey && !event.altKey) {
      const pad = document.querySelector(`.pad[data-key="${event.code}"]`);
      if (pad && !event.repeat) beginJog(pad);
    }
  }, true);
  document.addEventListener("keyup", (event) => {
    if (event.code === "Space") {
      event.preventDefault();
      event.stopPropagation();
    }
    letGo();
  }, true);

  // --- begin ------------------------------------------------------------------------------------------------------

  connect();
  setInterval(showFreshness, 100);
  setInterval(() => fill(texts), 1000); // elements that came later, or that the page made anew
})();
