// Curves of one group's axes over the last seconds, drawn on plain canvases: cheap at 20 frames a second.
const SECONDS = 20;
const DRAW_MS = 100;
const SHARE = 0.2; // of the time that drawing may take
const COLOURS = ["#2a78d6", "#e07b1a", "#2f9e5b", "#c2417f", "#8a56c2", "#3aa6b9"];

export default {
  template: `
    <div class="plots">
      <div class="legend"><span v-for="(name, i) in names" :style="{ color: colour(i) }">{{ name }}</span></div>
      <div v-for="plot in plots" class="plot">
        <div class="plot-title">{{ plot.title }} <span>{{ plot.unit }}</span></div>
        <canvas></canvas>
      </div>
    </div>`,
  props: { plots: Array, names: Array, columns: Array },

  mounted() {
    this.samples = [];
    this.canvases = [...this.$el.querySelectorAll("canvas")];
    this.off = window.axisync.on((frame) => this.take(frame));
    this.draw();
  },

  beforeUnmount() {
    this.off?.();
    clearTimeout(this.timer);
  },

  methods: {
    colour(i) {
      return COLOURS[i % COLOURS.length];
    },

    take(frame) {
      if (!frame.p || !frame.p.length) return;
      this.samples.push(...frame.p);
      const latest = this.samples[this.samples.length - 1][0];
      let first = this.samples.findIndex(([time]) => time <= latest && time > latest - SECONDS);
      if (first > 0) this.samples.splice(0, first);
      this.dirty = true;
    },

    draw() {
      const begin = performance.now();
      if (this.dirty && !document.hidden) {
        this.dirty = false;
        const ink = getComputedStyle(this.$el);
        this.plots.forEach((plot, i) => this.curve(this.canvases[i], plot, ink.color));
      }
      this.timer = setTimeout(() => this.draw(), Math.max(DRAW_MS, (performance.now() - begin) / SHARE));
    },

    curve(canvas, plot, ink) {
      const ratio = window.devicePixelRatio || 1;
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      if (!width || !height || !this.samples.length) return;
      if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
      if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
      const pen = canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, width, height);
      const range = this.range(plot);
      const scale = { ...range, left: 44, right: width - 4, top: 6, bottom: height - 6 };
      this.axes(pen, scale, ink);
      if (plot.actual !== undefined) this.lines(pen, scale, plot.actual, plot.factor, 2.5, 0.35);
      this.lines(pen, scale, plot.quantity, plot.factor, 1.4, 1);
    },

    range({ quantity, factor, least }) {
      let [low, high] = [Infinity, -Infinity];
      for (const [, values] of this.samples) {
        for (const column of this.columns) {
          const value = values[quantity][column];
          if (value === null) continue;
          low = Math.min(low, value * factor);
          high = Math.max(high, value * factor);
        }
      }
      if (low > high) return { low: -1, high: 1 };
      const spare = Math.max(0.06 * (high - low), (least - (high - low)) / 2, 1e-9);
      return { low: low - spare, high: high + spare };
    },

    axes(pen, { low, high, left, right, top, bottom }, ink) {
      const step = niceStep((high - low) / 3);
      pen.fillStyle = pen.strokeStyle = ink;
      pen.font = "11px system-ui, sans-serif";
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      pen.lineWidth = 1;
      for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
        const y = Math.round(bottom - ((value - low) / (high - low)) * (bottom - top)) + 0.5;
        pen.globalAlpha = 0.15;
        pen.beginPath();
        pen.moveTo(left, y);
        pen.lineTo(right, y);
        pen.stroke();
        pen.globalAlpha = 0.75;
        pen.fillText(tidy(value, step), left - 6, y);
      }
      pen.globalAlpha = 1;
    },

    lines(pen, { low, high, left, right, top, bottom }, quantity, factor, thickness, alpha) {
      const latest = this.samples[this.samples.length - 1][0];
      const x = (time) => right - ((latest - time) / SECONDS) * (right - left);
      const y = (value) => bottom - ((value * factor - low) / (high - low)) * (bottom - top);
      pen.lineWidth = thickness;
      pen.globalAlpha = alpha;
      pen.lineJoin = "round";
      this.columns.forEach((column, i) => {
        pen.strokeStyle = this.colour(i);
        pen.beginPath();
        let before = null;
        for (const [time, values] of this.samples) {
          const value = values[quantity][column];
          const gap = value === null || before === null || time - before > 0.5;
          if (value !== null) gap ? pen.moveTo(x(time), y(value)) : pen.lineTo(x(time), y(value));
          before = value === null ? null : time;
        }
        pen.stroke();
      });
      pen.globalAlpha = 1;
    },
  },
};

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  const part = rough / power;
  return power * (part > 5 ? 10 : part > 2 ? 5 : part > 1 ? 2 : 1);
}

function tidy(value, step) {
  const places = Math.max(0, -Math.floor(Math.log10(step)));
  return (Math.abs(value) < step / 2 ? 0 : value).toFixed(Math.min(6, places));
}
