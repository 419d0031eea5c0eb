// The gallery: who may it be, and enrol more.

import { ask } from "./api.js";
import { button, byId, complain, el, say } from "./dom.js";
import { showResult } from "./result.js";
import { count, odds } from "./words.js";

export async function describeGallery() {
  const found = await (await ask("gallery")).json();
  const words = `${found.gallery} holds ${count(found.impressions, "impression")} of ${count(found.subjects, "subject")}.`;
  for (const id of ["identify-gallery", "enrol-gallery"]) byId(id).textContent = words;
  return words;
}

const called = ({ subject, finger, impression }) => [subject, finger, impression].filter(Boolean).join("_");

export async function identify(slot, signal) {
  const list = byId("candidates");
  list.replaceChildren();
  say(`Searching the gallery for ${slot.file.name} …`);
  const probe = { probe: slot.file, dpi: slot.dpi.value };
  const found = await (await ask("identify", probe, signal)).json();
  const best = found.candidates[0];
  const { compared, enrolled } = found;
  const prints = compared < enrolled ? `${compared} of ${enrolled} prints` : count(compared, "print");
  say(best
    ? `${prints} compared in ${found.seconds.toFixed(2)} s; the best candidate is ${called(best)}, score ${best.score.toFixed(1)}.`
    : `${prints} compared; there is no candidate.`);
  byId("identify-words").hidden = !best;
  const cards = found.candidates.map((candidate) => card(candidate, (event) => open(candidate, event.currentTarget)));
  list.replaceChildren(...cards.map((button) => el("li", {}, button)));

  async function open(candidate, chosen) {
    for (const button of cards) button.setAttribute("aria-pressed", String(button === chosen));
    try {
      const path = `gallery/${candidate.id}`;
      const shown = await (await ask(`${path}/compare`, probe, signal)).json();
      if (chosen.getAttribute("aria-pressed") !== "true") return; // another was chosen meanwhile
      slot.tell(shown.probe);
      showResult(shown, probe, path);
    } catch (error) {
      if (error.name !== "AbortError") complain(error.message);
    }
  }
  if (cards.length) await open(best, cards[0]);
}

function card(candidate, open) {
  const rate = `${odds(candidate.fmr)}${candidate.extrapolated ? " (extrapolated)" : ""}`;
  const { expected_false_matches: chance, impressions, impression_score: alone } = candidate;
  const words = el("span", { class: "candidate-words" },
    el("strong", {}, `${candidate.rank}. ${called(candidate)}`),
    el("span", {}, `finger: score ${candidate.score.toFixed(1)}, FMR ${rate}`),
    el("span", {}, `${impressions === 1 ? "its only impression" : `best of ${impressions} impressions`}: score ${alone.toFixed(1)}`),
    el("span", {}, `${chance < 0.001 ? "hardly any" : Number(chance.toPrecision(2))} expected by chance`));
  return button(words, open, { class: candidate.score >= 40 ? "match" : "", "aria-pressed": "false" });
}

export async function enrol(slot, signal) {
  const files = [...slot.files];
  const list = byId("enrol-list");
  const bar = byId("enrol-progress");
  const part = (id) => byId(id).value.trim();
  list.replaceChildren();
  byId("enrol-run").hidden = false;
  byId("enrol-start").disabled = true;
  bar.max = files.length;
  bar.value = 0;
  const tally = { enrolled: 0, known: 0, failed: 0 };
  const words = () =>
    `${bar.value} of ${count(files.length, "file")}: ${tally.enrolled} enrolled`
    + `${tally.known ? `, ${tally.known} known already` : ""}${tally.failed ? `, ${tally.failed} failed` : ""}`;
  const one = async (file, k) => {
    const fields = { image: file, dpi: slot.dpi.value, subject: part("subject"), finger: part("finger") };
    if (fields.subject) {
      const first = part("impression");
      fields.impression = files.length > 1 ? String((Number(first) || 1) + k) : first;
    }
    try {
      const done = await (await ask("enrol", fields, signal)).json();
      tally[done.enrolled ? "enrolled" : "known"] += 1;
      const outcome = done.enrolled ? `enrolled as ${called(done)}, ${count(done.minutiae, "minutia", "minutiae")}` : "enrolled before";
      const remarks = [done.unmatched, ...done.notes].filter(Boolean).map((words) => `; ${words}`).join("");
      list.append(el("li", { class: done.enrolled ? "done" : "" }, `${file.name}: ${outcome}${remarks}`));
    } catch (error) {
      if (error.name === "AbortError") throw error;
      tally.failed += 1;
      list.append(el("li", { class: "failed" }, error.message));
    }
    bar.value += 1;
    byId("enrol-words").textContent = words();
  };
  try {
    for (const [k, file] of files.entries()) await one(file, k);
    say(`Done. ${words()}.`);
  } catch (error) {
    if (error.name !== "AbortError") throw error;
    say(`Stopped. ${words()}.`);
  } finally {
    byId("enrol-start").disabled = false;
    await describeGallery();
  }
}
