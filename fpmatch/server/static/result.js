// The decision, its evidence, and both prints to look at.

import { ask } from "./api.js";
import { byId, complain, el, save } from "./dom.js";
import { Examination } from "./examination.js";
import * as layer from "./marks.js";
import { Viewer } from "./viewer.js";
import { aboutRidges, cells, scale } from "./views.js";
import { count, minutia, odds, place, stem } from "./words.js";

const ALWAYS_MISSING = ["no ridges", "no finger", "unknown resolution"]; // at any threshold
const TICKS = [[20, "1 in 100"], [50, "1 in 100,000"], [80, "1 in 100 million"]];

// What asks the server for a comparison again, by the same fields: as files, for further views.
export function comparisonBy(fields, path, verify) {
  return {
    verify,
    report: async (threshold, { caseNumber, notes, marks }) =>
      (await ask(`${path}/case-report`, { ...fields, threshold, case_number: caseNumber, notes, marks: JSON.stringify(marks) })).blob(),
    overlay: async (format, view, threshold) =>
      (await ask(`${path}/overlay`, { ...fields, format, ...view, threshold })).blob(),
    views: async () => (await ask(`${path}/views`, fields)).json(),
  };
}

export function showResult(shown, source) {
  const view = new ResultView(shown, source);
  const root = byId("result");
  byId("main").classList.add("pictured");
  root.replaceChildren(view.verdict, view.evidence, view.stage);
  root.hidden = false;
  view.start();
}

class ResultView {
  constructor(shown, source) {
    this.shown = shown;
    this.source = source;
    this.threshold = shown.result.threshold;
    this.move = shown.result.transform && layer.mover(shown.result.transform);
    this.turn = 0; // degrees by which both prints are rotated
    this.linked = this.move !== null;
    this.examination = new Examination(() => this.arrange(this.view, true));
    this.verdict = this.#verdict();
    this.evidence = this.#evidence();
    this.stage = this.#stage();
  }

  start() {
    this.decide();
    this.arrange(this.move ? "over" : "beside");
  }

  get apart() {
    return this.view === "beside";
  }

  #verdict() {
    const { result } = this.shown;
    this.badge = el("p", { class: "badge", role: "status", id: "badge" });
    this.why = el("p", { class: "why", id: "why" });
    this.slider = el("input", {
      type: "range", id: "threshold", min: 0, max: 100, step: 0.5, value: this.threshold,
    });
    this.slider.addEventListener("input", () => {
      this.threshold = Number(this.slider.value);
      this.decide();
    });
    this.at = el("span", { id: "threshold-words" });
    this.bar = el("div", { class: "score-bar" });
    this.bar.style.width = `${result.score}%`;
    const ticks = TICKS.map(([score, words]) => {
      const tick = el("span", {}, words);
      tick.style.left = `${score}%`;
      return tick;
    });
    return el(
      "div",
      { class: "card verdict" },
      this.badge,
      el("p", { class: "score" }, el("b", { id: "score" }, result.score.toFixed(1)), el("span", {}, "score, of 100")),
      this.why,
      el("label", { for: "threshold" }, "Decide at a false match rate of ", this.at),
      el("div", { class: "gauge" }, el("div", { class: "score-track" }, this.bar), this.slider,
        el("div", { class: "ticks", "aria-hidden": "true" }, ...ticks)),
    );
  }

  decide() {
    const { result } = this.shown;
    const match = result.transform !== null && result.score >= this.threshold;
    const asked = this.threshold === result.threshold;
    const always = ALWAYS_MISSING.includes(result.missing);
    const lacking = !match && (always || (result.reachable_score === null
      ? result.missing !== null : result.reachable_score < this.threshold));
    const decision = match ? "MATCH" : lacking ? "INCONCLUSIVE" : "NO MATCH";
    this.badge.textContent = result.identical
      ? `${decision}, identical ${result.identical === "pixels" ? "images" : "templates"}` : decision;
    this.verdict.classList.toggle("match", match);
    this.verdict.classList.toggle("inconclusive", lacking);
    const rate = odds(10 ** (-this.threshold / 10));
    this.at.textContent = `${rate} (score ${this.threshold.toFixed(1)})`;
    this.slider.setAttribute("aria-valuetext", `${rate}, score ${this.threshold.toFixed(1)}: ${this.badge.textContent}`);
    const extrapolated = result.extrapolated ? `, extrapolated: measured up to ${odds(this.shown.smallest_measured_fmr)}` : "";
    const same = this.shown.rows.find(({ label }) => label === "Identical")?.words;
    const rarity = same ? `${same[0].toUpperCase()}${same.slice(1)}.` : result.fmr > 0.95 ? "Nearly all pairs of different fingers score as high."
      : `${result.score >= 100 ? "At most " : ""}${this.shown.odds} pairs of different fingers scores as high${extrapolated}.`;
    const enough = lacking ? `Even two such prints of one finger usually score less than ${this.threshold.toFixed(1)}.`
      : `The score does not reach ${this.threshold.toFixed(1)}.`;
    const no = (asked || always) && result.reason ? `${result.reason[0].toUpperCase()}${result.reason.slice(1)}.`
      : enough;
    this.why.textContent = match ? rarity : `${no} ${rarity}`;
  }

  #evidence() {
    const { shown } = this;
    const rows = shown.rows.filter(({ label }) => !["Score", "FMR", "Reason", "Missing"].includes(label));
    const facts = el("dl", { class: "facts" }, ...rows.flatMap(({ label, words }) => [el("dt", {}, label), el("dd", {}, words)]));
    const list = el("ol", { class: "pairs" }, ...shown.pairs.map(([i, j], k) => {
      const words = `probe ${minutia(shown.probe.minutiae[i])}; reference ${minutia(shown.reference.minutiae[j])}`;
      return el("li", {}, el("button", { type: "button", "data-pair": k + 1, "aria-label": `Pair ${k + 1}: ${words}` }, `${place(shown.probe.minutiae[i])} – ${place(shown.reference.minutiae[j])}`));
    }));
    const pairs = el("details", { class: "pair-list" }, el("summary", {}, count(shown.pairs.length, "pair")), list);
    const button = (words, id, does) => {
      const made = el("button", { type: "button", id }, words);
      made.addEventListener("click", () => this.#export(made, does));
      return made;
    };
    const exports = el(
      "div",
      { class: "exports", role: "group", "aria-label": "Export" },
      el("span", {}, "Export"),
      button("Overlay PNG", "export-png", () => this.#overlay("png")),
      button("Overlay SVG", "export-svg", () => this.#overlay("svg")),
      button("Case report", "export-report", async () => {
        this.#save(await this.source.report(this.threshold, this.examination), "case.html");
      }),
      button("Result JSON", "export-json", async () => {
        const result = await this.source.verify(this.threshold);
        this.#save(new Blob([`${JSON.stringify(result, null, 2)}\n`], { type: "application/json" }), "result.json");
      }),
    );
    return el("div", { class: "card evidence" }, facts, ...(shown.pairs.length ? [pairs] : []), this.examination.element, exports);
  }

  async #overlay(format) {
    const view = { side_by_side: this.apart, ridges: this.view === "ridges" };
    this.#save(await this.source.overlay(format, view, this.threshold), `overlay.${format}`);
  }

  // A download bears the names of both prints.
  #save(blob, name) {
    const { probe, reference } = this.shown;
    save(blob, [stem(probe.name), stem(reference.name), name].join("-"));
  }

  async #export(button, does) {
    button.disabled = true;
    complain("");
    try {
      await does();
    } catch (error) {
      complain(error.message);
    } finally {
      button.disabled = false;
      button.focus();
    }
  }

  #stage() {
    const keys = "Arrow keys move, plus and minus zoom, brackets rotate, 0 shows all.";
    this.over = new Viewer(`Probe over reference. ${keys}`);
    this.left = new Viewer(`Probe. ${keys}`);
    this.right = new Viewer(`Reference. ${keys}`);
    this.left.onview = () => this.#follow(this.left, this.right);
    this.right.onview = () => this.#follow(this.right, this.left);
    this.panes = el("div", { class: "panes" });
    this.info = el("p", { class: "pair-info", "aria-live": "polite" });
    this.drawn = el("p", { id: "drawn", "aria-live": "polite" });
    const choice = (words, view) => {
      const made = el("button", { type: "button", id: `view-${view}`, "aria-pressed": "false" }, words);
      made.addEventListener("click", () => this.#choose(view));
      return made;
    };
    this.choices = { over: choice("Overlay", "over"), beside: choice("Side by side", "beside"), ridges: choice("Ridges", "ridges") };
    this.choices.over.disabled = !this.move;
    if ((this.shown.result.compared?.ridge_agreement ?? null) === null) {
      this.choices.ridges.disabled = true;
      this.choices.ridges.title = "The ridges of these prints were not compared";
    }
    const tool = (words, label, does) => {
      const made = el("button", { type: "button", "aria-label": label, title: label }, words);
      made.addEventListener("click", () => does(this.viewers[0], this));
      return made;
    };
    this.fade = el("input", { type: "range", id: "fade", min: -100, max: 100, step: 1, value: 0 });
    this.fade.addEventListener("input", () => this.#fade());
    this.fader = el("div", { class: "fader" }, el("label", { for: "fade", class: "probe" }, "Probe"), this.fade,
      el("span", { class: "reference", "aria-hidden": "true" }, "Reference"));
    this.scale = el("div", { class: "fader", "aria-hidden": "true" });
    const tick = (words, id, name) => {
      const box = el("input", { type: "checkbox", id, checked: true });
      box.addEventListener("change", () => this.panes.classList.toggle(`without-${name}`, !box.checked));
      return el("label", { class: "tick" }, box, words);
    };
    this.link = el("input", { type: "checkbox", id: "link", checked: this.linked, disabled: !this.move });
    this.link.addEventListener("change", () => {
      this.linked = this.link.checked;
      this.arrange(this.view);
    });
    this.linker = el("label", { class: "tick", title: "Both prints show the same place, as large, and stand alike" }, this.link, "Linked");
    this.marking = el("button", { type: "button", id: "mark", "aria-pressed": "false", title: "Then click on a print" }, "Mark");
    this.marking.addEventListener("click", () => this.#mark(this.marking.getAttribute("aria-pressed") !== "true"));
    this.ofView = {
      over: el("div", {}, this.fader), beside: el("div", {}, this.linker, this.#pictureTools()), ridges: this.scale,
    };
    const full = el("button", { type: "button", id: "full", "aria-pressed": "false", hidden: !document.fullscreenEnabled }, "Full screen");
    full.addEventListener("click", () => (document.fullscreenElement ? document.exitFullscreen() : this.stage.requestFullscreen()));
    for (const root of [this.panes, this.evidence]) root.addEventListener("click", (e) => this.#pin(e.target));
    for (const event of ["pointerover", "focusin"]) {
      this.panes.addEventListener(event, (e) => this.#light(e.target));
      this.evidence.addEventListener(event, (e) => this.#light(e.target));
    }
    this.panes.addEventListener("pointerleave", () => this.#light(null));
    this.evidence.addEventListener("pointerleave", () => this.#light(null));
    return el(
      "div",
      { class: "stage", onfullscreenchange: () => full.setAttribute("aria-pressed", String(document.fullscreenElement !== null)) },
      el(
        "div",
        { class: "tools", role: "toolbar", "aria-label": "View" },
        el("div", { class: "choice" }, ...Object.values(this.choices)),
        el("div", { class: "zooms" },
          tool("−", "Zoom out", (viewer) => viewer.zoom(1 / 1.5)),
          tool("+", "Zoom in", (viewer) => viewer.zoom(1.5)),
          tool("⟲", "Rotate to the left", (viewer) => viewer.turn(-15)),
          tool("⟳", "Rotate to the right", (viewer) => viewer.turn(15)),
          tool("Fit", "Show all", (viewer) => viewer.fit())),
        this.marking,
        full,
        el("div", { class: "ticks-of-view" }, tick("Pairs", "show-pairs", "pairs"), tick("Other minutiae", "show-lone", "lone")),
        el("div", { class: "of-view" }, ...Object.values(this.ofView)),
      ),
      this.panes,
      el("div", { class: "below" }, this.drawn, this.info),
    );
  }

  // Show a view; what it needs beyond the comparison is asked of the server once.
  async #choose(view) {
    if (view === "ridges") {
      this.stage.setAttribute("aria-busy", "true");
      try {
        this.asked ??= this.source.views();
        this.further = await this.asked;
      } catch (error) {
        this.asked = null;
        complain(error.message);
        return;
      } finally {
        this.stage.removeAttribute("aria-busy");
      }
    }
    this.arrange(view);
  }

  #pictureTools() {
    const contrast = el("input", { type: "range", id: "contrast", min: 50, max: 300, step: 5, value: 100, "aria-label": "Contrast in percent" });
    contrast.addEventListener("input", () => this.panes.style.setProperty("--contrast", `${contrast.value}%`));
    const invert = el("input", { type: "checkbox", id: "invert" });
    invert.addEventListener("change", () => this.panes.style.setProperty("--invert", invert.checked ? 1 : 0));
    return el("div", { class: "picture-tools" }, el("label", { for: "contrast" }, "Contrast"), contrast,
      el("label", { class: "tick" }, invert, "Inverted"));
  }

  get viewers() {
    return this.apart ? [this.left, this.right] : [this.over];
  }

  // Show what `leader` shows in `follower`: the same place, as large, both prints standing alike.
  #follow(leader, follower) {
    if (!this.linked || !this.apart) {
      if (this.apart && follower.centre && leader.degrees !== follower.degrees) follower.turn(leader.degrees - follower.degrees);
      return;
    }
    const ahead = leader === this.left;
    const { x, y } = leader.centre;
    const [fx, fy] = ahead ? this.move.point([x, y]) : this.move.back([x, y]);
    const scale = ahead ? this.move.scale : 1 / this.move.scale;
    const degrees = leader.degrees + (ahead ? -1 : 1) * this.move.degrees;
    follower.fitting = leader.fitting * scale;
    follower.look({ x: fx, y: fy }, leader.unit * scale, degrees, leader.whole);
  }

  arrange(view, still = false) {
    const { probe, reference, pairs } = this.shown;
    const sameViewer = this.view && !this.apart && view !== "beside";
    const views = still || sameViewer ? this.viewers.map(({ centre, unit, degrees, whole }) => ({ centre, unit, degrees, whole })) : null;
    this.view = view;
    const { apart } = this;
    for (const [name, made] of Object.entries(this.choices)) made.setAttribute("aria-pressed", String(name === view));
    for (const [name, own] of Object.entries(this.ofView)) own.hidden = name !== view;
    this.panes.classList.toggle("apart", apart);
    if (!still) this.panes.replaceChildren(...this.viewers.map((viewer) => viewer.svg));
    const same = (point) => point;
    const [there, back] = [this.move?.point ?? null, this.move?.back ?? null];
    const inverse = { point: back };
    if (apart) {
      const linked = this.linked && this.move;
      const degrees = linked ? this.move.degrees : 0;
      for (const [viewer, print, side, angle, map] of [
        [this.left, probe, "probe", degrees, back], [this.right, reference, "reference", 0, there],
      ]) {
        const page = layer.boundsOf(print);
        const bounds = linked ? layer.together(layer.extentOf(print), layer.extentOf(...(side === "probe" ? [reference, inverse] : [probe, this.move]))) : page;
        const found = layer.minutiae(print, side, pairs, null, true);
        viewer.show(bounds, angle, layer.paper(page), layer.picture(print), found.lone, found.paired,
          this.examination.layer(side, same, map));
      }
      if (linked) this.left.fit();
      this.drawn.textContent = linked
        ? "Both prints as they are, the probe turned as in the overlay." : "Both prints as they are.";
    } else if (view === "ridges") {
      const { ridges } = this.further;
      const bounds = layer.together(layer.extentOf(reference), layer.extentOf(probe, this.move));
      const theirs = layer.minutiae(reference, "reference", pairs);
      this.scale.replaceChildren(...scale(ridges));
      this.over.show(bounds, 0, layer.paper(bounds), cells(ridges), layer.ink(reference, "plain"),
        theirs.lone, theirs.paired, this.examination.layer("reference", same, there));
      this.drawn.textContent = aboutRidges(ridges);
    } else {
      const bounds = layer.together(layer.extentOf(reference), layer.extentOf(probe, this.move));
      const ours = layer.minutiae(probe, "probe", pairs, this.move);
      const theirs = layer.minutiae(reference, "reference", pairs);
      this.over.show(bounds, 0, layer.paper(bounds),
        layer.ink(reference, "reference"), layer.ink(probe, "probe", this.move),
        theirs.lone, ours.lone, theirs.paired, layer.links(this.shown, this.move), ours.paired,
        this.examination.layer("reference", same, there));
      this.drawn.textContent = "The probe, moved by the similarity transform.";
      this.#fade();
    }
    views?.forEach(({ centre, unit, degrees, whole }, k) => {
      const viewer = this.viewers[k];
      if (!whole) viewer.look(centre, unit, degrees, whole);
      else if (degrees !== viewer.degrees) viewer.turn(degrees - viewer.degrees);
    });
    this.lit = undefined;
    this.#light(null);
  }

  #mark(on) {
    this.marking.setAttribute("aria-pressed", String(on));
    this.panes.classList.toggle("marking", on);
    const add = (side) => (on ? (point) => { this.#mark(false); this.examination.add(side, point); } : null);
    this.left.onpoint = add("probe");
    this.right.onpoint = this.over.onpoint = add("reference");
  }

  // The pair that was chosen stays lit in every view, until it is chosen again.
  #pin(target) {
    const number = target.closest?.("[data-pair]")?.dataset.pair;
    if (!number || this.panes.classList.contains("marking")) return;
    this.pinned = this.pinned === number ? null : number;
    this.lit = undefined;
    this.#light(this.pinned ? target : null);
  }

  #fade() {
    const value = Number(this.fade.value) / 100;
    this.panes.style.setProperty("--fade-probe", String(Math.min(1, 1 - value)));
    this.panes.style.setProperty("--fade-reference", String(Math.min(1, 1 + value)));
    const words = value === 0 ? "both prints" : value < 0 ? `reference faded by ${Math.round(-value * 100)} %`
      : `probe faded by ${Math.round(value * 100)} %`;
    this.fade.setAttribute("aria-valuetext", words);
  }

  #light(target) {
    const pairAt = (element) => element?.closest?.("[data-pair]")?.dataset.pair;
    const number = pairAt(target) ?? pairAt(document.activeElement) ?? this.pinned ?? null;
    if (number === this.lit) return;
    this.lit = number;
    for (const root of [this.panes, this.evidence]) {
      for (const one of root.querySelectorAll(".lit")) one.classList.remove("lit");
      if (number) for (const one of root.querySelectorAll(`[data-pair="${number}"]`)) one.classList.add("lit");
      root.classList.toggle("lighting", number !== null);
    }
    if (!number) {
      this.info.textContent = "";
      return;
    }
    const [i, j] = this.shown.pairs[number - 1];
    this.info.textContent = `Pair ${number}: probe ${minutia(this.shown.probe.minutiae[i])}; reference ${minutia(this.shown.reference.minutiae[j])}`;
  }
}
