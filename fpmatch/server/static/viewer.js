// A picture to zoom, pan and rotate, by mouse, touch and keys.

import { svg } from "./dom.js";

const CLOSEST = 12;
const STEP = 1.25;
const TURN = 15; // degrees

function turned({ x, y }, degrees, about) {
  const c = Math.cos((degrees * Math.PI) / 180);
  const s = Math.sin((degrees * Math.PI) / 180);
  const [dx, dy] = [x - about.x, y - about.y];
  return { x: about.x + c * dx - s * dy, y: about.y + s * dx + c * dy };
}

// The view is its `centre`, in pixels of the print; `unit`, pixels of the print a pixel of the
// screen; and `degrees`, by which the print is rotated clockwise. `onview` is told of changes.
export class Viewer {
  constructor(label) {
    this.layers = svg("g");
    const lifted = (event) => this.pointers.delete(event.pointerId);
    this.svg = svg("svg", {
      class: "viewer", tabindex: "0", role: "group", "aria-label": label,
      onpointerdown: (event) => this.#down(event), onpointermove: (event) => this.#move(event),
      onpointerup: lifted, onpointercancel: lifted,
      onclick: (event) => this.#click(event), onkeydown: (event) => this.#key(event),
    }, this.layers);
    this.svg.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    this.pointers = new Map();
    this.degrees = 0;
    this.onview = () => {};
    this.onpoint = null; // called with a place of the print that is clicked
    new ResizeObserver(() => (this.whole ? this.fit() : this.#apply())).observe(this.svg);
  }

  show(bounds, degrees, ...layers) {
    this.bounds = bounds;
    this.degrees = degrees;
    this.layers.replaceChildren(...layers);
    this.fit();
  }

  fit() {
    const { width, height } = this.#extent();
    const box = this.#box();
    this.whole = true;
    this.fitting = Math.max(width / box.width, height / box.height);
    this.unit = this.fitting;
    this.centre = this.#middle();
    this.#changed();
  }

  zoom(factor, at = this.centre) {
    const unit = Math.min(Math.max(this.unit / factor, this.fitting / CLOSEST), this.fitting);
    const share = unit / this.unit;
    this.unit = unit;
    this.centre = { x: at.x + (this.centre.x - at.x) * share, y: at.y + (this.centre.y - at.y) * share };
    this.whole = unit === this.fitting;
    if (this.whole) this.fit();
    else this.#keepInside();
  }

  pan(right, down) {
    const box = this.#box();
    const from = this.#turned(this.centre);
    const to = { x: from.x + right * box.width * this.unit, y: from.y + down * box.height * this.unit };
    this.centre = this.#unturned(to);
    this.#keepInside();
  }

  turn(degrees) {
    this.degrees = (this.degrees + degrees) % 360;
    if (this.whole) this.fit();
    else this.#changed();
  }

  // Follow another viewer, without being followed.
  look(centre, unit, degrees, whole) {
    if (!this.bounds) return;
    Object.assign(this, { centre, unit, degrees, whole: false });
    this.#apply();
    this.svg.classList.toggle("zoomed", !whole);
  }

  #box() {
    const { width, height } = this.svg.getBoundingClientRect();
    return { width: width || 1, height: height || 1 };
  }

  #middle() {
    const { x, y, width, height } = this.bounds;
    return { x: x + width / 2, y: y + height / 2 };
  }

  #turned(point) {
    return turned(point, this.degrees, this.#middle());
  }

  #unturned(point) {
    return turned(point, -this.degrees, this.#middle());
  }

  // What the rotated bounds take up, about the same middle.
  #extent() {
    const { x, y } = this.#middle();
    const [a, b] = [this.bounds.width, this.bounds.height];
    const [c, s] = [Math.cos, Math.sin].map((of) => Math.abs(of((this.degrees * Math.PI) / 180)));
    const [width, height] = [a * c + b * s, a * s + b * c];
    return { x: x - width / 2, y: y - height / 2, width, height };
  }

  #keepInside() {
    const { x, y, width, height } = this.#extent();
    const { x: cx, y: cy } = this.#turned(this.centre);
    const inside = (value, least, size) => Math.min(Math.max(value, least), least + size);
    this.centre = this.#unturned({ x: inside(cx, x, width), y: inside(cy, y, height) });
    this.#changed();
  }

  #changed() {
    this.#apply();
    this.svg.classList.toggle("zoomed", !this.whole);
    this.onview(this);
  }

  #apply() {
    if (!this.centre) return;
    const box = this.#box();
    const middle = this.#middle();
    const { x, y } = this.#turned(this.centre);
    const [width, height] = [box.width * this.unit, box.height * this.unit];
    this.svg.setAttribute("viewBox", `${x - width / 2} ${y - height / 2} ${width} ${height}`);
    this.layers.setAttribute("transform", `rotate(${this.degrees} ${middle.x} ${middle.y})`);
    this.svg.style.setProperty("--k", this.unit); // marks keep their size on screen
    this.svg.style.setProperty("--upright", `${-this.degrees}deg`); // and their letters stand
  }

  #at(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return this.#unturned(point);
  }

  #wheel(event) {
    const focused = document.activeElement === this.svg;
    if (!(event.ctrlKey || event.metaKey || focused)) return; // the page scrolls
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * 0.0015), this.#at(event));
  }

  #down(event) {
    this.pointers.set(event.pointerId, event);
    this.pressed = event;
  }

  #click(event) {
    const from = this.pressed ?? event;
    const moved = Math.hypot(event.clientX - from.clientX, event.clientY - from.clientY);
    if (this.onpoint && moved < 5) this.onpoint(this.#at(event));
  }

  #move(event) {
    const before = this.pointers.get(event.pointerId);
    if (event.buttons === 0) this.pointers.delete(event.pointerId);
    if (!before || event.buttons === 0) return;
    const others = [...this.pointers.values()].filter((one) => one.pointerId !== event.pointerId);
    if (others.length === 1) {
      const [other] = others;
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      this.zoom(apart(event) / Math.max(apart(before), 1), this.#at(event));
    } else if (this.svg.classList.contains("zoomed")) {
      this.svg.setPointerCapture(event.pointerId);
      const box = this.#box();
      this.pan((before.clientX - event.clientX) / box.width, (before.clientY - event.clientY) / box.height);
    }
    this.pointers.set(event.pointerId, event);
  }

  #key(event) {
    const does = {
      "+": () => this.zoom(STEP),
      "-": () => this.zoom(1 / STEP),
      0: () => this.fit(),
      "[": () => this.turn(-TURN),
      "]": () => this.turn(TURN),
      ArrowLeft: () => this.pan(-0.1, 0),
      ArrowRight: () => this.pan(0.1, 0),
      ArrowUp: () => this.pan(0, -0.1),
      ArrowDown: () => this.pan(0, 0.1),
    }[event.key];
    if (!does || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    does();
  }
}
