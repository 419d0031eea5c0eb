// A place to drop files on, or to choose them at.

import { el } from "./dom.js";
import { count, size } from "./words.js";

const SHOWN_BY_BROWSERS = /\.(png|jpe?g|bmp|gif|webp)$/i;

export class Slot {
  constructor(root, { title, hint, multiple = false, limit, changed, refused, stages = null }) {
    Object.assign(this, { root, title, limit, changed, refused, multiple });
    this.files = [];
    const id = `${root.id}-file`;
    this.input = el("input", { type: "file", id, multiple, class: "visually-hidden" });
    this.input.addEventListener("change", () => this.take([...this.input.files]));
    this.preview = el("img", { class: "preview", alt: "", hidden: true });
    this.words = el("span", { class: "hint" }, hint);
    this.hint = hint;
    const drop = el(
      "label",
      { class: "drop", for: id },
      this.preview,
      el("span", { class: "drop-words" }, el("strong", {}, title), this.words),
    );
    this.dpi = el("input", {
      type: "number", id: `${root.id}-dpi`, min: 100, max: 4000, step: "any", placeholder: "file’s own",
    });
    this.dpi.addEventListener("change", () => this.file && this.changed());
    this.more = el(
      "div",
      { class: "more" },
      el("label", { for: `${root.id}-dpi` }, "Resolution, dpi"),
      this.dpi,
    );
    if (stages) {
      this.stages = el("button", { type: "button", disabled: true }, "Stages");
      this.stages.setAttribute("aria-label", `Stages of ${title}`);
      this.stages.addEventListener("click", () => stages(this));
      this.more.append(this.stages);
    }
    this.notes = el("p", { class: "notes" });
    root.append(this.input, drop, this.more, this.notes);
    root.addEventListener("dragover", (event) => {
      event.preventDefault();
      root.classList.add("over");
    });
    root.addEventListener("dragleave", () => root.classList.remove("over"));
    root.addEventListener("drop", (event) => {
      event.preventDefault();
      event.stopPropagation();
      root.classList.remove("over");
      this.take([...event.dataTransfer.files]);
    });
  }

  get file() {
    return this.files[0] ?? null;
  }

  // Take files; what is more than this place holds goes to `overflow`.
  take(files) {
    if (!files.length) return;
    const large = files.find((file) => file.size > this.limit());
    if (large) {
      this.refused(`${large.name}: ${size(large.size)} are more than this server takes: ${size(this.limit())}.`);
      this.input.value = "";
      return;
    }
    const mine = this.multiple ? files : files.slice(0, 1);
    this.put(mine);
    if (files.length > 1 && this.overflow) this.overflow(files[1]);
    this.input.value = ""; // the same file may be chosen again
    this.changed();
  }

  put(files) {
    this.files = files.filter(Boolean);
    const { file } = this;
    this.root.classList.toggle("full", Boolean(file));
    this.words.textContent = !file ? this.hint
      : files.length > 1 ? `${files.length} files`
      : `${file.name}, ${size(file.size)}`;
    this.notes.textContent = "";
    if (this.stages) this.stages.disabled = !file;
    this.show(file && files.length === 1 && SHOWN_BY_BROWSERS.test(file.name) ? URL.createObjectURL(file) : null);
  }

  show(url) {
    if (this.preview.src.startsWith("blob:")) URL.revokeObjectURL(this.preview.src);
    this.preview.hidden = !url;
    if (url) this.preview.src = url;
    else this.preview.removeAttribute("src");
  }

  tell(print) {
    this.show(print.ink || print.kind === "image" ? print.picture : null);
    const facts = `${print.width} × ${print.height} px, ${Number(print.dpi.toFixed(1))} dpi, ${count(print.minutiae.length, "minutia", "minutiae")}`;
    this.notes.textContent = [facts, ...print.notes].join("; ");
    if (this.stages) this.stages.disabled = print.kind !== "image";
  }
}
