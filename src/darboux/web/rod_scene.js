// The rod in space: a tube whose vertices are replaced at each frame, what holds and loads it, turned by the mouse.
import { OrbitControls, THREE } from "nicegui-scene";

const COLOURS = {
  light: { back: "#fbfbfa", ink: "#3a3f45", rod: "#0072b2", mark: "#8fcbe8", ghost: "#dcdfe2", support: "#7d858c", load: "#d55e00" },
  dark: { back: "#15181b", ink: "#d5d9dd", rod: "#3d9bd6", mark: "#c4e6f7", ghost: "#30363c", support: "#98a1a9", load: "#ff8c42" },
};
const GREY = { light: ["#b4b8bc", "#dcdfe2"], dark: ["#5b6168", "#7b828a"] };
const SMOOTH = Math.cos(Math.PI / 5); // edges of an outline that turn by less are rounded
const MARGIN = 0.82; // of the view that the rod fills ...
const ABOVE = 40; // px that stay free above and below it, for words and the scale
const REST = 250; // ms without a new picture, after which a processor draws the last one finely
const BAR = [200, 46]; // px, of the canvas that the scale is drawn on
const FEW = 0.3; // of the view: a rod that is smaller is brought nearer

function floats(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

// Smooth edges take most of the time of a machine that draws by its processor.
function withoutGraphicsCard() {
  const gl = document.createElement("canvas").getContext("webgl2"), names = gl?.getExtension("WEBGL_debug_renderer_info");
  return Boolean(names) && /swiftshader|llvmpipe|software/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
}

// Normals of an outline's facets, and of their two ends: shared with the neighbour where the outline is smooth.
function facets(points, offset, m) {
  const x = (i) => points[offset + 2 * (((i % m) + m) % m)], y = (i) => points[offset + 2 * (((i % m) + m) % m) + 1];
  const flat = [];
  for (let i = 0; i < m; i++) {
    const dx = x(i + 1) - x(i), dy = y(i + 1) - y(i), l = Math.hypot(dx, dy) || 1;
    flat.push([dy / l, -dx / l]);
  }
  const join = (i, j) => {
    const a = flat[i], b = flat[((j % m) + m) % m];
    if (a[0] * b[0] + a[1] * b[1] < SMOOTH) return a;
    const l = Math.hypot(a[0] + b[0], a[1] + b[1]);
    return [(a[0] + b[0]) / l, (a[1] + b[1]) / l];
  };
  return flat.map((_, i) => [join(i, i - 1), join(i, i + 1)]);
}

// A tube of n sections with an outline of m points: each facet has its own vertices, so that colours meet in a line.
class Tube {
  constructor(material) {
    this.geometry = new THREE.BufferGeometry();
    this.mesh = new THREE.Mesh(this.geometry, material);
    this.mesh.frustumCulled = false;
  }
  sized(n, m) {
    if (this.n === n && this.m === m) return;
    [this.n, this.m] = [n, m];
    const caps = 2 * m;
    const count = 2 * m * n + caps;
    this.position = new Float32Array(3 * count);
    this.normal = new Float32Array(3 * count);
    this.colour = new Float32Array(3 * count);
    const index = [];
    for (let j = 0; j < n - 1; j++)
      for (let i = 0; i < m; i++) {
        const a = 2 * m * j + 2 * i, b = a + 2 * m;
        index.push(a, a + 1, b, a + 1, b + 1, b);
      }
    const first = 2 * m * n;
    for (let i = 1; i < m - 1; i++) {
      index.push(first, first + i + 1, first + i);
      index.push(first + m, first + m + i, first + m + i + 1);
    }
    this.geometry.dispose();
    this.geometry = this.mesh.geometry = new THREE.BufferGeometry();
    for (const [name, array] of [["position", this.position], ["normal", this.normal], ["color", this.colour]])
      this.geometry.setAttribute(name, new THREE.BufferAttribute(array, 3).setUsage(THREE.DynamicDrawUsage));
    this.geometry.setIndex(index);
  }
  shaped(data, outline) {
    const n = data.length / 9, { points, varies } = outline;
    const m = points.length / 2 / (varies ? n : 1);
    this.sized(n, m);
    let normals = facets(points, 0, m);
    const { position, normal } = this;
    const put = (at, j, x1, x2, u, v, w) => {
      const o = 9 * j;
      for (let c = 0; c < 3; c++) {
        const d1 = data[o + 3 + c], d2 = data[o + 6 + c];
        position[3 * at + c] = data[o + c] + x1 * d1 + x2 * d2;
        normal[3 * at + c] = w === undefined ? u * d1 + v * d2 : w[c];
      }
    };
    for (let j = 0; j < n; j++) {
      const offset = varies ? 2 * m * j : 0;
      if (varies && j) normals = facets(points, offset, m);
      for (let i = 0; i < m; i++) {
        const k = (i + 1) % m, at = 2 * m * j + 2 * i, [a, b] = normals[i];
        put(at, j, points[offset + 2 * i], points[offset + 2 * i + 1], a[0], a[1]);
        put(at + 1, j, points[offset + 2 * k], points[offset + 2 * k + 1], b[0], b[1]);
      }
    }
    for (const [end, j, sign] of [[0, 0, -1], [1, n - 1, 1]]) {
      const o = 9 * j, offset = varies ? 2 * m * j : 0;
      const d1 = new THREE.Vector3(...data.slice(o + 3, o + 6)), d2 = new THREE.Vector3(...data.slice(o + 6, o + 9));
      const d3 = d1.cross(d2).multiplyScalar(sign).toArray();
      for (let i = 0; i < m; i++) put(2 * m * n + end * m + i, j, points[offset + 2 * i], points[offset + 2 * i + 1], 0, 0, d3);
    }
    this.geometry.attributes.position.needsUpdate = this.geometry.attributes.normal.needsUpdate = true;
  }
  coloured(bright, plain, mark) {
    const { n, m, colour } = this, two = [new THREE.Color(plain), new THREE.Color(mark)].map((c) => c.toArray());
    for (let at = 0; at < colour.length / 3; at++) {
      const facet = Math.floor((at % (2 * m)) / 2);
      colour.set(two[at < 2 * m * n && bright[facet] ? 1 : 0], 3 * at);
    }
    this.geometry.attributes.color.needsUpdate = true;
  }
}

function arrow(material, length, width) {
  const group = new THREE.Group(), head = Math.min(0.4 * length, 3.2 * width);
  const shaft = new THREE.Mesh(new THREE.CylinderGeometry(width * 0.42, width * 0.42, length - head, 12), material);
  const cone = new THREE.Mesh(new THREE.ConeGeometry(width * 1.25, head, 20), material);
  shaft.position.y = (length - head) / 2;
  cone.position.y = length - head / 2;
  group.add(shaft, cone);
  return group;
}

function circleArrow(material, radius, width) {
  const group = new THREE.Group();
  const ring = new THREE.Mesh(new THREE.TorusGeometry(radius, width * 0.42, 10, 40, 1.5 * Math.PI), material);
  const cone = new THREE.Mesh(new THREE.ConeGeometry(width * 1.25, 3.2 * width, 20), material);
  cone.position.set(0, -radius, 0);
  cone.rotation.z = -Math.PI / 2;
  group.add(ring, cone);
  const turned = new THREE.Group();
  group.rotation.x = -Math.PI / 2; // its axis along y, like an arrow's
  turned.add(group);
  return turned;
}

// Letters that were drawn before, by text and colour: a new material is a new program of the graphics card, and slow.
const LETTERS = new Map();

function letter(text, colour) {
  const known = LETTERS.get(text + colour) || lettered(text, colour);
  LETTERS.set(text + colour, known);
  const sprite = new THREE.Sprite(known);
  sprite.scale.set(0.62, 0.62, 1);
  return sprite;
}

function lettered(text, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d");
  pen.font = "italic 52px serif";
  pen.fillStyle = colour;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 32, 34);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  return new THREE.SpriteMaterial({ map, depthTest: false });
}

// Take what is drawn out of a scene, and free its shapes but not its materials.
function emptied(group) {
  group.traverse((part) => !part.isSprite && part.geometry?.dispose());
  group.clear();
}

export default {
  template: `<div style="position:relative;overflow:hidden">
    <canvas style="position:absolute;inset:0;width:100%;height:100%;outline:none" tabindex="0" role="img"
      aria-label="The rod in space; drag to turn it, scroll to come nearer"></canvas>
    <canvas style="position:absolute;right:0;bottom:0;width:${BAR[0]}px;height:${BAR[1]}px;pointer-events:none"></canvas></div>`,
  props: { dark: Boolean },
  mounted() {
    const [canvas, paper] = this.$el.children;
    Object.assign(this, { canvas, paper, overlays: [], glyphs: [], frames: 0, drawn: 0, held: false, grey: false, standing: 0 });
    this.scene = new THREE.Scene();
    this.corner = new THREE.Scene();
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
    this.camera.up.set(0, 0, 1);
    this.look = new THREE.OrthographicCamera(-1.6, 1.6, 1.6, -1.6, 0.1, 10);
    this.direction = new THREE.Vector3(0.35, -1, 0.35).normalize();
    this.lamp = new THREE.DirectionalLight(0xffffff, 2.1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f96, 1.6), this.lamp);
    this.signs = new THREE.Group(); // what holds and loads the rod
    this.scene.add(this.signs);
    this.inks = {
      support: new THREE.MeshLambertMaterial(), load: new THREE.MeshLambertMaterial(),
      axis: new THREE.MeshBasicMaterial(), direction: new THREE.MeshBasicMaterial(),
    };
    this.material = new THREE.MeshLambertMaterial({ vertexColors: true });
    this.rod = new Tube(this.material);
    this.ghost = new Tube(new THREE.MeshBasicMaterial({ depthWrite: false })); // behind all else
    this.ghost.mesh.renderOrder = -1;
    this.scene.add(this.rod.mesh, this.ghost.mesh);
    this.rod.mesh.visible = this.ghost.mesh.visible = false;
    try {
      this.software = withoutGraphicsCard();
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !this.software });
    } catch {
      this.$el.innerHTML = "<p style='padding:2em'>This browser draws no WebGL; the numbers and plots are still right.</p>";
      return;
    }
    this.renderer.autoClear = false;
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => this.later());
    this.controls.addEventListener("end", () => {
      this.held = true;
      this.tell();
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.later());
    this.watcher = new ResizeObserver(() => this.resized());
    this.watcher.observe(this.$el);
    this.painted();
    this.resized();
    this.$emit("ready");
  },
  unmounted() {
    clearTimeout(this.resting);
    this.watcher?.disconnect();
    this.controls?.dispose();
    this.renderer?.dispose();
  },
  watch: {
    dark() {
      this.painted();
    },
  },
  methods: {
    // -- what the server sends --------------------------------------------------------------------------------------
    // Where `still` is null, the unloaded rod is the last one; where it is "", there is none.
    frame(number, data, outline, still) {
      if (still !== null) this.still = still ? floats(still) : null;
      if (outline) {
        this.outline = { points: floats(outline.points), bright: outline.bright, varies: outline.varies };
        const change = this.thickness() / this.signedFor;
        if (!(change > 0.8 && change < 1.25)) this.signed(); // they are as large as the section asks for
      }
      if (outline || still !== null) this.stilled();
      this.data = floats(data);
      if (this.renderer) {
        this.rod.shaped(this.data, this.outline);
        if (!this.coloured || outline) this.recoloured();
        this.rod.mesh.visible = true;
        this.placed();
        this.followed();
        this.later();
      }
      this.frames += 1;
      // What tests, and whoever looks at the page by a program, read.
      this.$el.dataset.frames = this.frames;
      this.$el.dataset.end = Array.from(this.data.slice(-9, -6), (x) => x.toPrecision(6)).join(" ");
      this.$emit("received", number);
    },
    // The unloaded rod, behind all else.
    stilled() {
      if (!this.renderer) return;
      this.ghost.mesh.visible = Boolean(this.still && this.outline);
      if (!this.ghost.mesh.visible) return;
      const { points, bright, varies } = this.outline; // the middle's, where it varies
      const m = bright.length, at = varies ? 2 * m * Math.floor(points.length / (4 * m)) : 0;
      this.ghost.shaped(this.still, { points: points.slice(at, at + 2 * m), varies: false });
    },
    // Glyphs: {kind, at (share of the rod), vector, follower}; in the corner: {letter, vector}.
    acting(glyphs, corner, size) {
      if (!this.renderer) return;
      Object.assign(this, { size, stated: glyphs, cornered: corner });
      this.directed();
      this.signed();
      this.placed();
      this.later();
    },
    signed() {
      this.signedFor = this.thickness();
      emptied(this.signs);
      this.glyphs = (this.stated || []).map((stated) => ({ ...stated, object: this.glyph(stated) }));
      for (const glyph of this.glyphs) this.signs.add(glyph.object);
    },
    others(list) {
      for (const mesh of this.overlays) {
        this.scene.remove(mesh);
        mesh.geometry.dispose();
      }
      this.overlays = [];
      const shown = list.filter((entry) => entry.data);
      shown.forEach((entry, k) => {
        const data = floats(entry.data), n = data.length / 9, radius = 0.35 * this.thickness();
        const curve = (i) => new THREE.Vector3(data[9 * i], data[9 * i + 1], data[9 * i + 2]);
        const material = new THREE.MeshBasicMaterial({ color: entry.colour, depthTest: false, transparent: true });
        for (let i = 0; i + 3 < n; i += 3) {
          if ((i / 3) % shown.length !== k) continue;
          const path = new THREE.CatmullRomCurve3([curve(i), curve(i + 1), curve(i + 2), curve(i + 3)]);
          const mesh = new THREE.Mesh(new THREE.TubeGeometry(path, 6, radius, 8), material);
          mesh.renderOrder = 5;
          this.overlays.push(mesh);
          this.scene.add(mesh);
        }
      });
      this.later();
    },
    greyed(grey) {
      if (this.grey === grey) return;
      this.grey = grey;
      this.recoloured();
      this.later();
    },
    seen(camera) {
      if (!this.renderer) return;
      if (!camera.length) {
        this.held = false;
        return;
      }
      this.direction.set(camera[0], camera[1], camera[2]).normalize();
      this.pointed(new THREE.Vector3(camera[3], camera[4], camera[5]), camera[6]);
      this.held = this.placedOnce = true;
      this.later();
    },
    // A new scenario: look at it from here, all of it.
    towards(direction) {
      Object.assign(this, { first: direction, placedOnce: false, held: false, still: null });
      if (this.renderer) this.ghost.mesh.visible = false;
    },
    fit() {
      this.held = false;
      if (this.data) this.fitted();
      this.tell();
      this.later();
    },
    picture(name, title) {
      if (!this.renderer) return;
      const { clientWidth: w, clientHeight: h } = this.$el, scale = Math.max(2, window.devicePixelRatio);
      this.renderer.setPixelRatio(scale);
      this.renderer.setSize(w, h, false);
      [this.paper.width, this.paper.height] = BAR.map((side) => side * scale);
      this.measure = "";
      this.draw(true);
      const whole = document.createElement("canvas");
      [whole.width, whole.height] = [w * scale, h * scale];
      const pen = whole.getContext("2d");
      pen.drawImage(this.canvas, 0, 0, whole.width, whole.height);
      pen.drawImage(this.paper, whole.width - this.paper.width, whole.height - this.paper.height);
      pen.font = `${13 * scale}px system-ui, sans-serif`;
      pen.fillStyle = this.colours().ink;
      pen.fillText(title, 14 * scale, 24 * scale);
      whole.toBlob((blob) => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = name;
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 10000);
      });
      this.resized();
    },
    // -- drawing ----------------------------------------------------------------------------------------------------
    colours() {
      return COLOURS[this.dark ? "dark" : "light"];
    },
    later() {
      if (this.waiting || !this.renderer) return;
      this.waiting = requestAnimationFrame(() => {
        this.waiting = 0;
        this.draw();
      });
    },
    draw(fine) {
      const { renderer, camera, look } = this, back = new THREE.Color(this.colours().back);
      this.lamp.position.copy(camera.position).add(new THREE.Vector3(0, 0, camera.top / camera.zoom));
      this.lamp.target.position.copy(this.controls.target);
      this.lamp.target.updateMatrixWorld();
      const { clientWidth: w, clientHeight: h } = this.$el, ratio = Math.min(window.devicePixelRatio, 2);
      if (this.software) {
        const wanted = fine ? Math.max(2, ratio) : ratio;
        clearTimeout(this.resting);
        if (!fine) this.resting = setTimeout(() => this.draw(true), REST);
        if (renderer.getPixelRatio() !== wanted) renderer.setPixelRatio(wanted);
      }
      const [left, below, size] = this.free(w, h);
      renderer.setViewport(0, 0, w, h);
      renderer.setClearColor(back);
      renderer.clear();
      renderer.render(this.scene, camera);
      renderer.clearDepth();
      renderer.setViewport(left, below, size, size);
      look.position.copy(camera.position).sub(this.controls.target).normalize().multiplyScalar(5);
      look.up.copy(camera.up);
      look.lookAt(0, 0, 0);
      renderer.render(this.corner, look);
      renderer.setViewport(0, 0, w, h);
      this.measured();
      this.$el.dataset.drawn = this.drawn += 1;
      this.$el.dataset.corner = [left, below, size].join(" ");
    },
    // Where the axes stand, [from the left, from below, size] in px: where they stood, or else in a corner free of the rod.
    free(w, h) {
      const size = Math.min(116, 0.36 * Math.min(w, h)), high = h - size - 30, point = new THREE.Vector3(), seen = [];
      const corners = [[6, 6], [w - size - 6, 46], [6, high], [w - size - 50, high]];
      for (let o = 0; this.data && o < this.data.length; o += 9) {
        point.set(this.data[o], this.data[o + 1], this.data[o + 2]).project(this.camera);
        seen.push([(0.5 + 0.5 * point.x) * w, (0.5 + 0.5 * point.y) * h]);
      }
      const hits = ([x, y]) => seen.filter(([a, b]) => a > x - 8 && a < x + size + 8 && b > y - 8 && b < y + size + 8).length;
      const counts = corners.map(hits), least = Math.min(...counts);
      if (2 * least < counts[this.standing]) this.standing = counts.indexOf(least);
      return [...corners[this.standing], size];
    },
    // A bar whose length is true in the picture's plane.
    measured() {
      const { clientWidth: w, clientHeight: h } = this.$el, scale = this.paper.width / BAR[0], pen = this.paper.getContext("2d");
      const perMetre = (h * this.camera.zoom) / (this.camera.top - this.camera.bottom), room = Math.min(160, 0.25 * w) / perMetre;
      const power = Math.pow(10, Math.floor(Math.log10(room)));
      const length = power * [5, 2, 1].find((step) => step * power <= room);
      const [unit, factor] = [["km", 1e3], ["m", 1], ["cm", 1e-2], ["mm", 1e-3], ["µm", 1e-6], ["nm", 1e-9]].find(
        ([, factor]) => length >= 0.999 * factor,
      ) || ["m", 1];
      const said = [w, h, scale, perMetre, this.dark].join();
      if (said === this.measure) return;
      this.measure = said;
      pen.setTransform(scale, 0, 0, scale, 0, 0);
      pen.clearRect(0, 0, ...BAR);
      pen.strokeStyle = pen.fillStyle = this.colours().ink;
      pen.lineWidth = 2;
      const right = BAR[0] - 18, left = right - length * perMetre, y = BAR[1] - 18;
      pen.beginPath();
      pen.moveTo(left, y - 5);
      pen.lineTo(left, y);
      pen.lineTo(right, y);
      pen.lineTo(right, y - 5);
      pen.stroke();
      pen.font = "13px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.fillText(`${Number((length / factor).toPrecision(3))} ${unit}`, 0.5 * (left + right), y - 8);
    },
    resized() {
      if (!this.renderer) return;
      const { clientWidth: w, clientHeight: h } = this.$el, ratio = Math.min(window.devicePixelRatio, 2);
      if (!w || !h) return;
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(w, h, false);
      [this.paper.width, this.paper.height] = BAR.map((side) => side * ratio);
      this.measure = "";
      const half = this.camera.top;
      [this.camera.left, this.camera.right] = [(-half * w) / h, (half * w) / h];
      this.camera.updateProjectionMatrix();
      if (this.data && !this.held) this.fitted();
      this.later();
    },
    recoloured() {
      if (!this.data || !this.renderer) return;
      const colours = this.colours(), [plain, mark] = this.grey ? GREY[this.dark ? "dark" : "light"] : [colours.rod, colours.mark];
      this.rod.coloured(this.outline.bright, plain, mark);
      this.coloured = true;
    },
    painted() {
      if (!this.renderer) return;
      const { ghost, support, load, ink } = this.colours(), { inks } = this;
      this.recoloured();
      this.ghost.mesh.material.color.set(ghost);
      for (const [material, colour] of [[inks.support, support], [inks.load, load], [inks.axis, ink], [inks.direction, load]])
        material.color.set(colour);
      this.directed();
      this.later();
    },
    // The axes, and the directions of gravity and the like, in the corner.
    directed() {
      const { ink, load } = this.colours(), { inks } = this, up = new THREE.Vector3(0, 1, 0);
      emptied(this.corner);
      const axis = (vector, text, material, colour, length, aside) => {
        const direction = new THREE.Vector3(...vector).normalize();
        const shown = arrow(material, length, 0.075);
        shown.quaternion.setFromUnitVectors(up, direction);
        const name = letter(text, colour);
        name.position.copy(direction).multiplyScalar(aside ? 0.55 * length : length + 0.26);
        if (aside) name.position.add(Math.abs(direction.x) > 0.7 ? new THREE.Vector3(0, 0, -0.3) : new THREE.Vector3(-0.32, 0, 0));
        this.corner.add(shown, name);
      };
      axis([1, 0, 0], "x", inks.axis, ink, 1);
      axis([0, 1, 0], "y", inks.axis, ink, 1);
      axis([0, 0, 1], "z", inks.axis, ink, 1);
      for (const { letter: text, vector } of this.cornered || []) axis(vector, text, inks.direction, load, 0.8, true);
    },
    thickness() {
      const points = this.outline ? this.outline.points : [0];
      let largest = 0;
      for (const x of points) largest = Math.max(largest, Math.abs(x));
      return largest;
    },
    glyph(stated) {
      const L = this.size, width = Math.max(0.011 * L, 0.8 * this.thickness()), group = new THREE.Group();
      const { support: grey, load: red } = this.inks;
      const side = Math.max(0.045 * L, 3 * this.thickness());
      if (stated.kind === "clamp") {
        const block = new THREE.Mesh(new THREE.BoxGeometry(1.7 * side, 1.7 * side, 0.55 * side), grey);
        block.position.z = -0.275 * side * (stated.at === 1 ? -1 : 1);
        group.add(block);
      } else if (stated.kind === "pin") {
        group.add(new THREE.Mesh(new THREE.SphereGeometry(0.5 * side, 24, 16), grey));
      } else if (stated.kind === "slide") {
        const direction = new THREE.Vector3(...stated.vector);
        for (const turn of [1, -1]) {
          const head = arrow(grey, 1.4 * side, 0.5 * width);
          head.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction.clone().multiplyScalar(turn));
          group.add(head);
        }
        group.add(new THREE.Mesh(new THREE.SphereGeometry(0.35 * side, 24, 16), grey));
      } else if (stated.kind === "spring") {
        const points = [];
        for (let i = 0; i <= 80; i++)
          points.push(new THREE.Vector3(0.3 * side * Math.cos(0.5 * i), 0.3 * side * Math.sin(0.5 * i), -(i / 80) * 1.6 * side));
        group.add(new THREE.Mesh(new THREE.TubeGeometry(new THREE.CatmullRomCurve3(points), 160, 0.09 * side, 6), grey));
      } else {
        const vector = new THREE.Vector3(...stated.vector).normalize(), up = new THREE.Vector3(0, 1, 0);
        const shown = stated.kind === "moment" ? circleArrow(red, 0.075 * L, width) : arrow(red, stated.size * L, width * stated.width);
        shown.quaternion.setFromUnitVectors(up, vector);
        if (stated.kind === "press") shown.position.copy(vector).multiplyScalar(-stated.size * L - this.thickness());
        group.add(shown);
      }
      return group;
    },
    placed() {
      if (!this.data) return;
      const n = this.data.length / 9, basis = new THREE.Matrix4();
      for (const glyph of this.glyphs) {
        const o = 9 * Math.round(glyph.at * (n - 1)), part = (k) => new THREE.Vector3(...this.data.slice(o + k, o + k + 3));
        glyph.object.position.copy(part(0));
        if (glyph.follower) {
          const d1 = part(3), d2 = part(6);
          glyph.object.quaternion.setFromRotationMatrix(basis.makeBasis(d1, d2, d1.clone().cross(d2)));
        }
      }
    },
    // -- the camera -------------------------------------------------------------------------------------------------
    extent() {
      const right = new THREE.Vector3(), above = new THREE.Vector3();
      const backward = this.direction;
      right.crossVectors(this.camera.up, backward);
      if (right.lengthSq() < 1e-6) right.set(1, 0, 0);
      right.normalize();
      above.crossVectors(backward, right);
      const low = [1e30, 1e30, 1e30], high = [-1e30, -1e30, -1e30];
      for (const data of [this.data, this.still, this.reach()])
        for (let i = 0; data && i < data.length; i += 9) {
          const p = [right, above, backward].map((a) => a.x * data[i] + a.y * data[i + 1] + a.z * data[i + 2]);
          for (let c = 0; c < 3; c++) [low[c], high[c]] = [Math.min(low[c], p[c]), Math.max(high[c], p[c])];
        }
      const middle = low.map((x, c) => 0.5 * (x + high[c]));
      const centre = right.clone().multiplyScalar(middle[0]).addScaledVector(above, middle[1]).addScaledVector(backward, middle[2]);
      return { centre, wide: high[0] - low[0], tall: high[1] - low[1] };
    },
    // The far ends of the arrows, each in place of a section.
    reach() {
      const n = this.data.length / 9, places = [];
      for (const { kind, at, vector, size, follower } of this.glyphs) {
        if (!vector || follower || kind === "slide") continue;
        const o = 9 * Math.round(at * (n - 1)), way = new THREE.Vector3(...vector).setLength((kind === "press" ? -size : size) * this.size);
        places.push(this.data[o] + way.x, this.data[o + 1] + way.y, this.data[o + 2] + way.z, 0, 0, 0, 0, 0, 0);
      }
      return places;
    },
    needed() {
      const { centre, wide, tall } = this.extent(), { clientWidth: w, clientHeight: h } = this.$el;
      const room = Math.max(0.4, Math.min(1, (1 - (2 * ABOVE) / h) / MARGIN));
      return { centre, height: Math.max(tall / room, (wide * h) / w, 0.15 * (this.size || 0), 1e-9) };
    },
    fitted() {
      const { centre, height } = this.needed();
      this.pointed(centre, height / MARGIN);
    },
    pointed(centre, height) {
      const { clientWidth: w, clientHeight: h } = this.$el, { camera, controls } = this, far = 20 * Math.max(height, this.size || height);
      [camera.top, camera.bottom, camera.zoom] = [height / 2, -height / 2, 1];
      [camera.left, camera.right] = [(-height / 2) * (w / h), (height / 2) * (w / h)];
      [camera.near, camera.far] = [1e-3 * far, 2 * far];
      camera.position.copy(centre).addScaledVector(this.direction, far);
      controls.target.copy(centre);
      camera.updateProjectionMatrix();
      controls.update();
    },
    // Keep the rod in sight unless the visitor has chosen the view.
    followed() {
      if (this.held || !this.$el.clientHeight) return;
      this.direction.copy(this.camera.position).sub(this.controls.target);
      if (!this.placedOnce || this.direction.lengthSq() < 1e-30) this.direction.set(...(this.first || [0.35, -1, 0.35]));
      this.direction.normalize();
      const { centre, height } = this.needed(), seen = this.camera.top - this.camera.bottom;
      const off = centre.clone().sub(this.controls.target);
      off.addScaledVector(this.direction, -off.dot(this.direction));
      if (!this.placedOnce || height + 2 * off.length() > 0.97 * seen || height < FEW * seen) {
        this.placedOnce = true;
        this.fitted();
      }
    },
    tell() {
      const { camera, controls } = this;
      this.direction.copy(camera.position).sub(controls.target).normalize();
      const numbers = [...this.direction.toArray(), ...controls.target.toArray(), (camera.top - camera.bottom) / camera.zoom];
      this.$emit("camera", this.held ? numbers : []);
    },
  },
};
