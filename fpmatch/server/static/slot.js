// A place to drop files on, or to choose them at.

import { button, el } from "./dom.js";
import { count, size } from "./words.js";

const SHOWN_BY_BROWSERS = /\.(png|jpe?g|bmp|gif|webp)$/i;

export class Slot {
  constructor(root, { title, hint, multiple = false, limit, changed, refused, stages = null }) {
    Object.assign(this, { root, hint, limit, changed, refused, multiple });
    this.files = [];
    const [file, dpi] = [`${root.id}-file`, `${root.id}-dpi`];
    this.input = el("input", {
      type: "file", id: file, multiple, class: "visually-hidden", onchange: () => this.take([...this.input.files]),
    });
    this.preview = el("img", { class: "preview", alt: "", hidden: true });
    this.words = el("span", { class: "hint" }, hint);
    this.dpi = el("input", {
      type: "number", id: dpi, min: 100, max: 4000, step: "any", placeholder: "file’s own",
      onchange: () => this.file && this.changed(),
    });
    this.stages = stages && button("Stages", () => stages(this), { disabled: true, "aria-label": `Stages of ${title}` });
    this.notes = el("p", { class: "notes" });
    root.append(
      this.input,
      el("label", { class: "drop", for: file },
        this.preview,
        el("span", { class: "drop-words" }, el("strong", {}, title), this.words)),
      el("div", { class: "more" }, el("label", { for: dpi }, "Resolution, dpi"), this.dpi, this.stages),
      this.notes,
    );
    root.addEventListener("dragover", () => root.classList.add("over"));
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
    const large = files.find((file) => file.size > this.limit);
    this.input.value = ""; // the same file may be chosen again
    if (large) {
      this.refused(`${large.name}: ${size(large.size)} are more than this server takes: ${size(this.limit)}.`);
      return;
    }
    this.put(this.multiple ? files : files.slice(0, 1));
    if (files.length > 1 && this.overflow) this.overflow(files[1]);
    this.changed();
  }

  put(files) {
    this.files = files;
    const { file } = this;
    this.root.classList.add("full");
    this.words.textContent = files.length > 1 ? `${files.length} files` : `${file.name}, ${size(file.size)}`;
    this.notes.textContent = "";
    if (this.stages) this.stages.disabled = false;
    this.show(files.length === 1 && SHOWN_BY_BROWSERS.test(file.name) ? URL.createObjectURL(file) : null);
  }

  show(url) {
    if (this.preview.src.startsWith("blob:")) URL.revokeObjectURL(this.preview.src);
    this.preview.hidden = !url;
    this.preview.src = url ?? "";
  }

  tell(print) {
    this.show(print.ink || print.kind === "image" ? print.picture : null);
    const facts = `${print.width} × ${print.height} px, ${Number(print.dpi.toFixed(1))} dpi, ${count(print.minutiae.length, "minutia", "minutiae")}`;
    this.notes.textContent = [facts, ...print.notes].join("; ");
    if (this.stages) this.stages.disabled = print.kind !== "image";
  }
}
