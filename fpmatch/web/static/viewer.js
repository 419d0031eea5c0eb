// A picture to zoom and pan, by mouse, touch and keys.

import { svg } from "./dom.js";

const CLOSEST = 12;
const STEP = 1.25;

export class Viewer {
  constructor(label) {
    this.layers = svg("g");
    this.svg = svg("svg", { class: "viewer", tabindex: "0", role: "group", "aria-label": label }, this.layers);
    this.pointers = new Map();
    this.svg.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    this.svg.addEventListener("pointerdown", (event) => this.#down(event));
    this.svg.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) {
      this.svg.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    this.svg.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#apply()).observe(this.svg);
  }

  show(bounds, ...layers) {
    this.bounds = bounds;
    this.layers.replaceChildren(...layers);
    this.fit();
  }

  fit() {
    this.view = { ...this.bounds };
    this.#apply();
  }

  zoom(factor, at = null) {
    const { view, bounds } = this;
    const wanted = Math.min(Math.max(bounds.width / view.width * factor, 1), CLOSEST);
    const width = bounds.width / wanted;
    const height = bounds.height / wanted;
    const x = at ? at.x : view.x + view.width / 2;
    const y = at ? at.y : view.y + view.height / 2;
    this.view = {
      x: x - ((x - view.x) * width) / view.width,
      y: y - ((y - view.y) * height) / view.height,
      width,
      height,
    };
    this.#apply();
  }

  pan(right, down) {
    this.view.x += right * this.view.width;
    this.view.y += down * this.view.height;
    this.#apply();
  }

  #apply() {
    if (!this.view) return;
    const { view, bounds } = this;
    view.x = Math.min(Math.max(view.x, bounds.x), bounds.x + bounds.width - view.width);
    view.y = Math.min(Math.max(view.y, bounds.y), bounds.y + bounds.height - view.height);
    this.svg.setAttribute("viewBox", `${view.x} ${view.y} ${view.width} ${view.height}`);
    const box = this.svg.getBoundingClientRect();
    const scale = Math.min(box.width / view.width, box.height / view.height) || 1;
    this.svg.style.setProperty("--k", 1 / scale); // marks keep their size on screen
    this.svg.classList.toggle("zoomed", view.width < bounds.width * 0.999);
  }

  #at(event) {
    const point = new DOMPoint(event.clientX, event.clientY);
    return point.matrixTransform(this.svg.getScreenCTM().inverse());
  }

  #wheel(event) {
    const focused = document.activeElement === this.svg;
    if (!(event.ctrlKey || event.metaKey || focused)) return; // the page scrolls
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * 0.0015), this.#at(event));
  }

  #down(event) {
    this.pointers.set(event.pointerId, event);
  }

  #move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    if (event.buttons === 0) {
      this.pointers.delete(event.pointerId);
      return;
    }
    const others = [...this.pointers.values()].filter((one) => one.pointerId !== event.pointerId);
    if (others.length === 1) {
      const [other] = others;
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      this.zoom(apart(event) / Math.max(apart(before), 1), this.#at(event));
    } else if (this.svg.classList.contains("zoomed")) {
      this.svg.setPointerCapture(event.pointerId);
      const from = this.#at(before);
      const to = this.#at(event);
      this.view.x -= to.x - from.x;
      this.view.y -= to.y - from.y;
      this.#apply();
    }
    this.pointers.set(event.pointerId, event);
  }

  #key(event) {
    const does = {
      "+": () => this.zoom(STEP),
      "=": () => this.zoom(STEP),
      "-": () => this.zoom(1 / STEP),
      0: () => this.fit(),
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
