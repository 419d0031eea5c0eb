// What an examiner adds to a comparison: marks on the prints, and notes.

import { button, el, svg } from "./dom.js";

const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";

const nameOf = (index) => LETTERS[index % 26] + (index < 26 ? "" : String(Math.floor(index / 26) + 1));

export class Examination {
  constructor(changed) {
    this.changed = changed; // the marks have to be drawn again
    this.marks = []; // { side, x, y, note }
    this.text = el("textarea", { id: "notes", rows: 3, "aria-label": "Notes on the comparison", placeholder: "Notes on the comparison" });
    this.number = el("input", { id: "case-number", maxlength: 60, "aria-label": "Case number", placeholder: "Case number", autocomplete: "off" });
    this.list = el("ol", { class: "own-marks" });
    this.element = el(
      "details",
      { class: "examination" },
      el("summary", {}, "Marks and notes"),
      el("p", { class: "hint" }, "Choose Mark above the picture, then click on a print. Marks, notes and case number stay on this page, and go into the case report."),
      this.number,
      this.list,
      this.text,
    );
  }

  // The fields of a case report.
  get fields() {
    return { case_number: this.number.value, notes: this.text.value, marks: JSON.stringify(this.marks) };
  }

  add(side, { x, y }) {
    this.marks.push({ side, x: Math.round(x), y: Math.round(y), note: "" });
    this.element.open = true;
    this.#show();
    this.list.lastElementChild.querySelector("input").focus({ preventScroll: true });
  }

  #show() {
    this.list.replaceChildren(...this.marks.map((mark, index) => this.#row(mark, nameOf(index))));
    this.changed();
  }

  #row(mark, name) {
    const note = el("input", {
      value: mark.note, "aria-label": `Note on mark ${name}`, placeholder: `${mark.side} ${mark.x}, ${mark.y}`,
      oninput: () => { mark.note = note.value; },
    });
    const remove = button("✕", () => {
      this.marks.splice(this.marks.indexOf(mark), 1);
      this.#show();
    }, { "aria-label": `Remove mark ${name}` });
    return el("li", {}, el("b", {}, name), note, remove);
  }

  // The marks of one side where they are, and dashed where those of the other side fall.
  layer(side, own, other = null) {
    const drawn = this.marks.map((mark, index) => {
      const here = mark.side === side;
      const map = here ? own : other;
      return map && cross(map([mark.x, mark.y]), nameOf(index), here, `${mark.side} ${mark.note}`);
    });
    return svg("g", { class: "own" }, ...drawn.filter(Boolean));
  }
}

function cross([x, y], name, here, words) {
  const group = svg("g", { class: here ? "own-mark" : "own-mark elsewhere" },
    svg("title", {}, `mark ${name}: ${words}`),
    svg("path", { d: "M-9 0H9M0 -9V9" }),
    svg("circle", { r: 9 }),
    svg("text", { x: 11, y: -7 }, name));
  group.style.transform = `translate(${x}px, ${y}px) scale(var(--k)) rotate(var(--upright))`;
  return group;
}
