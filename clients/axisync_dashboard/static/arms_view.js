// The arms in 3D. The chain of frames does the kinematics: every axis turns its group about z, as the DH rows say.
import { OrbitControls, THREE } from "nicegui-scene";

const [WIDTH_DEG, HEIGHT_DEG] = [66, 38]; // seen at least, however narrow the view is
const FRAME_MS = 50;
const SHARE = 0.3; // of the time that drawing may take, where there is no graphics processor
const STILL_RAD = 1e-4; // less than a pixel: encoders are never quite still
const TRACE_POINTS = 400;
const TRACE_STEP_M = 0.002;
const COLOURS = [0x2a78d6, 0xe07b1a, 0x2f9e5b, 0x8a56c2];

function matrix(rows) {
  return new THREE.Matrix4().set(...rows.flat());
}

function capsule([start, end, radius], material) {
  const from = new THREE.Vector3(...start);
  const to = new THREE.Vector3(...end);
  const way = to.clone().sub(from);
  const mesh = new THREE.Mesh(new THREE.CapsuleGeometry(radius, way.length(), 6, 18), material);
  mesh.position.copy(from).add(to).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
  return mesh;
}

// A chain of groups; returns what turns, and the tool's frame.
function chain(parent, arm, material) {
  const turning = [];
  for (const link of arm.links) {
    const fixed = new THREE.Group();
    fixed.applyMatrix4(matrix(link.fixed));
    const turns = new THREE.Group();
    fixed.add(turns);
    parent.add(fixed);
    link.capsules.forEach((segment) => turns.add(capsule(segment, material)));
    turning.push(turns);
    parent = turns;
  }
  const tool = new THREE.Group();
  tool.applyMatrix4(matrix(arm.tool));
  parent.add(tool);
  return { turning, tool };
}

function line(colour, opacity) {
  const material = new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity });
  const drawn = new THREE.Line(new THREE.BufferGeometry(), material);
  drawn.frustumCulled = false;
  return drawn;
}

export default {
  template: `<div class="arms-view"><canvas></canvas></div>`,
  props: { arms: Array, boxes: Array },

  mounted() {
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(HEIGHT_DEG, 1.6, 0.02, 30);
    this.camera.up.set(0, 0, 1);
    try {
      this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, canvas: this.$el.children[0] });
    } catch {
      this.$el.textContent = "This browser draws no 3D (WebGL is off). Everything else works.";
      return;
    }
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.build();
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.target.set(...this.middle());
    this.camera.position.set(1.05, 0.75, 0.65).add(this.controls.target);
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.update();
    this.off = window.axisync.on((frame) => this.take(frame));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.$el);
    this.draw();
    this.$el.view = this;
  },

  beforeUnmount() {
    this.off?.();
    this.observer?.disconnect();
    clearTimeout(this.timer);
    this.renderer?.dispose();
  },

  methods: {
    build() {
      this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 2.2));
      const sun = new THREE.DirectionalLight(0xffffff, 1.6);
      sun.position.set(2, 1.2, 3);
      this.scene.add(sun);
      const grid = new THREE.GridHelper(2, 20, 0x888888, 0x888888);
      grid.rotateX(Math.PI / 2);
      grid.position.z = Math.min(0, ...this.boxes.map((box) => box.matrix[2][3] - box.size[2] / 2));
      grid.material.transparent = true;
      grid.material.opacity = 0.25;
      this.scene.add(grid);
      this.boxes.forEach((box) => this.scene.add(this.box(box)));
      this.drawn = this.arms.map((arm, number) => this.arm(arm, COLOURS[number % COLOURS.length]));
      this.dirty = true;
    },

    box({ matrix: placed, size }) {
      const material = new THREE.MeshStandardMaterial({ color: 0x8a929c, transparent: true, opacity: 0.35, depthWrite: false });
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
      mesh.applyMatrix4(matrix(placed));
      return mesh;
    },

    arm(arm, colour) {
      const solid = new THREE.MeshStandardMaterial({ color: colour, roughness: 0.45, metalness: 0.1 });
      const pale = new THREE.MeshStandardMaterial({ color: colour, transparent: true, opacity: 0.22, depthWrite: false });
      const body = new THREE.Group();
      const ghost = new THREE.Group();
      const path = line(colour, 0.95);
      const trace = line(colour, 0.45);
      this.scene.add(body, ghost, path, trace);
      const live = chain(body, arm, solid);
      live.tool.add(new THREE.AxesHelper(0.07));
      ghost.visible = path.visible = false;
      return { group: arm.group, axes: arm.axes, live, ghost, ends: chain(ghost, arm, pale).turning, path, trace, points: [] };
    },

    middle() {
      const mean = (i) => this.arms.reduce((sum, arm) => sum + arm.links[0].fixed[i][3], 0) / Math.max(1, this.arms.length);
      return [mean(0), mean(1), mean(2) + 0.08];
    },

    take(frame) {
      for (const arm of this.drawn) {
        arm.axes.forEach((axis, i) => {
          const angle = frame.q[axis];
          if (angle === undefined || angle === null) return;
          if (Math.abs(arm.live.turning[i].rotation.z - angle) < STILL_RAD) return;
          arm.live.turning[i].rotation.z = angle;
          this.dirty = true;
        });
        this.leaveTrace(arm);
        this.show(arm, this.preview?.[arm.group] ?? frame.ghosts[arm.group]);
      }
    },

    leaveTrace(arm) {
      const place = arm.live.tool.getWorldPosition(new THREE.Vector3());
      const last = arm.points[arm.points.length - 1];
      if (last && last.distanceTo(place) < TRACE_STEP_M) return;
      arm.points.push(place);
      if (arm.points.length > TRACE_POINTS) arm.points.shift();
      arm.trace.geometry.dispose();
      arm.trace.geometry = new THREE.BufferGeometry().setFromPoints(arm.points);
      this.dirty = true;
    },

    // What is planned: the arm at its end, and the tool's way there.
    show(arm, ghost) {
      const mark = ghost ? JSON.stringify(ghost) : "";
      if (arm.mark === mark) return;
      arm.mark = mark;
      this.dirty = true;
      arm.ghost.visible = Boolean(ghost);
      arm.path.visible = Boolean(ghost && ghost.path.length);
      if (!ghost) return;
      ghost.end.forEach((angle, i) => (arm.ends[i].rotation.z = angle));
      arm.path.geometry.dispose();
      arm.path.geometry = new THREE.BufferGeometry().setFromPoints(ghost.path.map((point) => new THREE.Vector3(...point)));
    },

    setPreview(ghosts) {
      this.preview = ghosts;
    },

    // For whoever wants to know where a tool is drawn: metres in O.
    toolPosition(group) {
      const arm = this.drawn.find((each) => each.group === group);
      return arm.live.tool.getWorldPosition(new THREE.Vector3()).toArray();
    },

    resize() {
      const { clientWidth, clientHeight } = this.$el;
      if (!clientWidth || !clientHeight) return;
      this.renderer.setSize(clientWidth, clientHeight);
      this.camera.aspect = clientWidth / clientHeight;
      const half = Math.atan(Math.tan((WIDTH_DEG * Math.PI) / 360) / this.camera.aspect);
      this.camera.fov = Math.max(HEIGHT_DEG, (360 / Math.PI) * half);
      this.camera.updateProjectionMatrix();
      this.dirty = true;
    },

    draw() {
      const begin = performance.now();
      if (this.dirty && !document.hidden) {
        this.dirty = false;
        this.renderer.render(this.scene, this.camera);
      }
      const spent = performance.now() - begin;
      this.timer = setTimeout(() => this.draw(), Math.max(FRAME_MS, spent / SHARE));
    },
  },
};
