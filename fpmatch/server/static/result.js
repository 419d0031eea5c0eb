// The decision, its evidence, and both prints to look at.

import { ask } from "./api.js";
import { button, byId, complain, el, save, tick } from "./dom.js";
import { Examination } from "./examination.js";
import * as layer from "./marks.js";
import { Viewer } from "./viewer.js";
import { count, minutia, odds, pairOf, place, sentence, stem } from "./words.js";

const ALWAYS_MISSING = ["no ridges", "no finger", "unknown resolution"]; // at any threshold
const TICKS = [[20, "1 in 100"], [50, "1 in 100,000"], [80, "1 in 100 million"]];
const KEYS = "Arrow keys move, plus and minus zoom, brackets rotate, 0 shows all.";

// Show a comparison. `path` is the address where the server makes it again from the same `fields`.
export function showResult(shown, fields, path) {
  const view = new ResultView(shown, fields, path);
  byId("main").classList.add("pictured");
  byId("result").replaceChildren(view.verdict, view.evidence, view.stage);
  byId("result").hidden = false;
  view.decide();
  view.arrange(view.move ? "over" : "beside");
}

class ResultView {
  constructor(shown, fields, path) {
    Object.assign(this, { shown, fields, path });
    this.threshold = shown.result.threshold;
    this.move = shown.result.transform && layer.mover(shown.result.transform);
    this.linked = this.move !== null;
    this.examination = new Examination(() => this.arrange(this.view, true));
    this.verdict = this.#verdict();
    this.evidence = this.#evidence();
    this.stage = this.#stage();
  }

  get apart() {
    return this.view === "beside";
  }

  get viewers() {
    return this.apart ? [this.left, this.right] : [this.over];
  }

  #ask(what, more = {}) {
    return ask(`${this.path}/${what}`, { ...this.fields, threshold: this.threshold, ...more });
  }

  #verdict() {
    const { score } = this.shown.result;
    this.badge = el("output", { class: "badge", id: "badge", for: "threshold" });
    this.why = el("p", { class: "why", id: "why" });
    this.at = el("span", { id: "threshold-words" });
    this.slider = el("input", {
      type: "range", id: "threshold", min: 0, max: 100, step: 0.5, value: this.threshold,
      oninput: () => {
        this.threshold = Number(this.slider.value);
        this.decide();
      },
    });
    const ticks = TICKS.map(([at, words]) => {
      const made = el("span", {}, words);
      made.style.left = `${at}%`;
      return made;
    });
    return el("div", { class: "card verdict" },
      this.badge,
      el("p", { class: "score" }, el("b", { id: "score" }, score.toFixed(1)), el("span", {}, "score, of 100")),
      this.why,
      el("label", { for: "threshold" }, "Decide at a false match rate of ", this.at),
      el("div", { class: "gauge" },
        el("progress", { value: score, max: 100, "aria-label": "Score" }),
        this.slider,
        el("div", { class: "ticks", "aria-hidden": "true" }, ...ticks)));
  }

  decide() {
    const { shown: { result, rows, odds: rarely, smallest_measured_fmr: measured }, threshold } = this;
    const match = result.transform !== null && result.score >= threshold;
    const always = ALWAYS_MISSING.includes(result.missing);
    const short = result.reachable_score === null ? result.missing !== null : result.reachable_score < threshold;
    const lacking = !match && (always || short);
    const decision = match ? "MATCH" : lacking ? "INCONCLUSIVE" : "NO MATCH";
    const images = result.identical === "pixels" ? "images" : "templates";
    this.badge.textContent = result.identical ? `${decision}, identical ${images}` : decision;
    this.verdict.classList.toggle("match", match);
    this.verdict.classList.toggle("inconclusive", lacking);
    const rate = odds(10 ** (-threshold / 10));
    this.at.textContent = `${rate} (score ${threshold.toFixed(1)})`;
    this.slider.setAttribute("aria-valuetext", `${rate}, score ${threshold.toFixed(1)}: ${this.badge.textContent}`);
    const extrapolated = result.extrapolated ? `, extrapolated: measured up to ${odds(measured)}` : "";
    const same = rows.find(({ label }) => label === "Identical")?.words;
    const rarity = same ? sentence(same) : result.fmr > 0.95 ? "Nearly all pairs of different fingers score as high."
      : `${result.score >= 100 ? "At most " : ""}${rarely} pairs of different fingers scores as high${extrapolated}.`;
    const enough = lacking ? `Even two such prints of one finger usually score less than ${threshold.toFixed(1)}.`
      : `The score does not reach ${threshold.toFixed(1)}.`;
    const stated = (always || threshold === result.threshold) && result.reason;
    this.why.textContent = match ? rarity : `${stated ? sentence(result.reason) : enough} ${rarity}`;
  }

  #evidence() {
    const { rows, pairs, probe, reference } = this.shown;
    const facts = rows.filter(({ label }) => !["Score", "FMR", "Reason", "Missing"].includes(label))
      .flatMap(({ label, words }) => [el("dt", {}, label), el("dd", {}, words)]);
    const list = pairs.map(([i, j], k) => el("li", {}, el(
      "button",
      { type: "button", "data-pair": k + 1, "aria-label": pairOf(this.shown, k) },
      `${place(probe.minutiae[i])} – ${place(reference.minutiae[j])}`,
    )));
    const exporting = (words, id, name, make) =>
      button(words, (event) => this.#export(event.currentTarget, name, make), { id: `export-${id}` });
    const overlay = (format) => () =>
      this.#ask("overlay", { format, side_by_side: this.apart, ridges: this.view === "ridges" });
    return el("div", { class: "card evidence" },
      el("dl", { class: "facts" }, ...facts),
      pairs.length ? el("details", { class: "pair-list" }, el("summary", {}, count(pairs.length, "pair")),
        el("ol", { class: "pairs" }, ...list)) : null,
      this.examination.element,
      el("div", { class: "exports", role: "group", "aria-label": "Export" },
        el("span", {}, "Export"),
        exporting("Overlay PNG", "png", "overlay.png", overlay("png")),
        exporting("Overlay SVG", "svg", "overlay.svg", overlay("svg")),
        exporting("Case report", "report", "case.html", () => this.#ask("case-report", this.examination.fields)),
        exporting("Result JSON", "json", "result.json", async () =>
          new Response(`${JSON.stringify((await (await this.#ask("compare")).json()).result, null, 2)}\n`))));
  }

  // A download bears the names of both prints.
  async #export(pressed, name, make) {
    pressed.disabled = true;
    complain("");
    try {
      const { probe, reference } = this.shown;
      save(await (await make()).blob(), [stem(probe.name), stem(reference.name), name].join("-"));
    } catch (error) {
      complain(error.message);
    } finally {
      pressed.disabled = false;
      pressed.focus();
    }
  }

  #stage() {
    this.over = new Viewer(`Probe over reference. ${KEYS}`);
    this.left = new Viewer(`Probe. ${KEYS}`);
    this.right = new Viewer(`Reference. ${KEYS}`);
    this.left.onview = () => this.#follow(this.left, this.right);
    this.right.onview = () => this.#follow(this.right, this.left);
    this.panes = el("div", { class: "panes" });
    this.info = el("p", { class: "pair-info", "aria-live": "polite" });
    this.drawn = el("p", { id: "drawn", "aria-live": "polite" });
    const choice = (words, view, disabled = false) =>
      button(words, () => this.#choose(view), { id: `view-${view}`, disabled });
    this.choices = {
      over: choice("Overlay", "over", !this.move),
      beside: choice("Side by side", "beside"),
      ridges: choice("Ridges", "ridges", (this.shown.result.compared?.ridge_agreement ?? null) === null),
    };
    const tool = (words, label, does) => button(words, () => does(this.viewers[0]), { "aria-label": label, title: label });
    const hiding = (name) => (checked) => this.panes.classList.toggle(`without-${name}`, !checked);
    this.fade = el("input", { type: "range", id: "fade", min: -100, max: 100, step: 1, value: 0, oninput: () => this.#fade() });
    this.scale = el("div", { class: "fader", "aria-hidden": "true" });
    this.marking = button("Mark", () => this.#mark(this.marking.getAttribute("aria-pressed") !== "true"),
      { id: "mark", "aria-pressed": "false", title: "Then click on a print" });
    const style = (name, value) => this.panes.style.setProperty(name, value);
    const relink = (checked) => {
      this.linked = checked;
      this.arrange("beside");
    };
    this.ofView = {
      over: el("div", {}, el("div", { class: "fader" }, el("label", { for: "fade", class: "probe" }, "Probe"), this.fade,
        el("span", { class: "reference", "aria-hidden": "true" }, "Reference"))),
      beside: el("div", {},
        tick("Linked", relink, { id: "link", checked: this.linked, disabled: !this.move }),
        el("div", { class: "picture-tools" },
          el("label", { for: "contrast" }, "Contrast"),
          el("input", {
            type: "range", id: "contrast", min: 50, max: 300, step: 5, value: 100, "aria-label": "Contrast in percent",
            oninput: ({ target }) => style("--contrast", `${target.value}%`),
          }),
          tick("Inverted", (checked) => style("--invert", checked ? 1 : 0), { id: "invert" }))),
      ridges: this.scale,
    };
    for (const root of [this.panes, this.evidence]) {
      root.addEventListener("click", (event) => this.#pin(event.target));
      for (const event of ["pointerover", "focusin"]) root.addEventListener(event, ({ target }) => this.#light(target));
      root.addEventListener("pointerleave", () => this.#light(null));
    }
    return el("div", { class: "stage" },
      el("div", { class: "tools", role: "toolbar", "aria-label": "View" },
        el("div", { class: "choice" }, ...Object.values(this.choices)),
        el("div", { class: "zooms" },
          tool("−", "Zoom out", (viewer) => viewer.zoom(1 / 1.5)),
          tool("+", "Zoom in", (viewer) => viewer.zoom(1.5)),
          tool("⟲", "Rotate to the left", (viewer) => viewer.turn(-15)),
          tool("⟳", "Rotate to the right", (viewer) => viewer.turn(15)),
          tool("Fit", "Show all", (viewer) => viewer.fit())),
        this.marking,
        el("div", { class: "ticks-of-view" },
          tick("Pairs", hiding("pairs"), { id: "show-pairs", checked: true }),
          tick("Other minutiae", hiding("lone"), { id: "show-lone", checked: true })),
        el("div", { class: "of-view" }, ...Object.values(this.ofView))),
      this.panes,
      el("div", { class: "below" }, this.drawn, this.info));
  }

  // Show a view; the map of ridge agreement is asked of the server once.
  async #choose(view) {
    if (view === "ridges" && !this.ridges) {
      this.stage.setAttribute("aria-busy", "true");
      try {
        this.ridges = (await (await this.#ask("views")).json()).ridges;
      } catch (error) {
        complain(error.message);
        return;
      } finally {
        this.stage.removeAttribute("aria-busy");
      }
    }
    this.arrange(view);
  }

  // Show what `leader` shows in `follower`: the same place, as large, both prints standing alike.
  #follow(leader, follower) {
    if (!this.apart) return;
    if (!this.linked) {
      if (follower.centre && leader.degrees !== follower.degrees) follower.turn(leader.degrees - follower.degrees);
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

  // Draw a view anew; `still`: the same one, with other marks.
  arrange(view, still = false) {
    const { probe, reference, pairs } = this.shown;
    const kept = still || (this.view && !this.apart && view !== "beside")
      ? this.viewers.map(({ centre, unit, degrees, whole }) => ({ centre, unit, degrees, whole })) : [];
    this.view = view;
    for (const [name, made] of Object.entries(this.choices)) made.setAttribute("aria-pressed", String(name === view));
    for (const [name, own] of Object.entries(this.ofView)) own.hidden = name !== view;
    this.panes.classList.toggle("apart", this.apart);
    if (!still) this.panes.replaceChildren(...this.viewers.map((viewer) => viewer.svg));
    const [there, back] = [this.move?.point ?? null, this.move?.back ?? null];
    const own = (side, other) => this.examination.layer(side, (point) => point, other);
    if (this.apart) this.#drawApart(own, there, back);
    else {
      const bounds = layer.together(layer.extentOf(reference), layer.extentOf(probe, this.move));
      const ours = layer.minutiae(probe, "probe", pairs, this.move);
      const theirs = layer.minutiae(reference, "reference", pairs);
      const drawn = view === "ridges"
        ? [layer.cells(this.ridges), layer.ink(reference, "plain"), theirs.lone, theirs.paired]
        : [layer.ink(reference, "reference"), layer.ink(probe, "probe", this.move), theirs.lone, ours.lone,
          theirs.paired, layer.links(this.shown, this.move), ours.paired];
      this.over.show(bounds, 0, layer.paper(bounds), ...drawn, own("reference", there));
      if (view === "ridges") this.scale.replaceChildren(...layer.scale(this.ridges));
      this.drawn.textContent = view === "ridges" ? layer.aboutRidges(this.ridges) : "The probe, moved by the similarity transform.";
    }
    kept.forEach(({ centre, unit, degrees, whole }, k) => {
      const viewer = this.viewers[k];
      if (!whole) viewer.look(centre, unit, degrees, whole);
      else if (degrees !== viewer.degrees) viewer.turn(degrees - viewer.degrees);
    });
    this.#light(null, true);
  }

  #drawApart(own, there, back) {
    const { probe, reference, pairs } = this.shown;
    for (const [viewer, print, side, other, move, map] of [
      [this.left, probe, "probe", reference, { point: back }, back],
      [this.right, reference, "reference", probe, this.move, there],
    ]) {
      const page = layer.boundsOf(print);
      const bounds = this.linked ? layer.together(layer.extentOf(print), layer.extentOf(other, move)) : page;
      const degrees = this.linked && side === "probe" ? this.move.degrees : 0;
      const { lone, paired } = layer.minutiae(print, side, pairs, null, true);
      viewer.show(bounds, degrees, layer.paper(page), layer.picture(print), lone, paired, own(side, map));
    }
    if (this.linked) this.left.fit();
    this.drawn.textContent = `Both prints as they are${this.linked ? ", the probe turned as in the overlay" : ""}.`;
  }

  #mark(on) {
    this.marking.setAttribute("aria-pressed", String(on));
    this.panes.classList.toggle("marking", on);
    const add = (side) => (on ? (point) => { this.#mark(false); this.examination.add(side, point); } : null);
    this.left.onpoint = add("probe");
    this.right.onpoint = this.over.onpoint = add("reference");
  }

  #fade() {
    const value = Number(this.fade.value) / 100;
    this.panes.style.setProperty("--fade-probe", String(Math.min(1, 1 - value)));
    this.panes.style.setProperty("--fade-reference", String(Math.min(1, 1 + value)));
    this.fade.setAttribute("aria-valuetext", value === 0 ? "both prints"
      : `${value < 0 ? "reference" : "probe"} faded by ${Math.round(Math.abs(value) * 100)} %`);
  }

  // The pair that was chosen stays lit in every view, until it is chosen again.
  #pin(target) {
    const number = target.closest?.("[data-pair]")?.dataset.pair;
    if (!number || this.panes.classList.contains("marking")) return;
    this.pinned = this.pinned === number ? null : number;
    this.#light(this.pinned ? target : null, true);
  }

  #light(target, anew = false) {
    const pairAt = (element) => element?.closest?.("[data-pair]")?.dataset.pair;
    const number = pairAt(target) ?? pairAt(document.activeElement) ?? this.pinned ?? null;
    if (number === this.lit && !anew) return;
    this.lit = number;
    for (const root of [this.panes, this.evidence]) {
      for (const one of root.querySelectorAll("[data-pair]")) one.classList.toggle("lit", one.dataset.pair === number);
      root.classList.toggle("lighting", number !== null);
    }
    this.info.textContent = number ? pairOf(this.shown, number - 1) : "";
  }
}
