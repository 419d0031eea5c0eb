// The stages of an extraction, to look through.

import { ask } from "./api.js";
import { byId, complain, say } from "./dom.js";

let stages = [];

export async function lookThrough(slot) {
  say(`Extracting ${slot.file.name} stage by stage …`);
  complain("");
  try {
    const answer = await ask("stages", { image: slot.file, dpi: slot.dpi.value });
    const found = await answer.json();
    stages = found.stages;
    byId("stages-title").textContent = `Stages of ${found.name}`;
    byId("stage-slider").max = stages.length - 1;
    show(stages.length - 1);
    byId("stages").showModal();
    byId("stage-slider").focus();
  } catch (error) {
    complain(error.message);
  } finally {
    say("");
  }
}

function show(index) {
  const k = Math.min(Math.max(index, 0), stages.length - 1);
  const { name, words, range, picture } = stages[k];
  byId("stage-slider").value = k;
  byId("stage-slider").setAttribute("aria-valuetext", name);
  byId("stage-picture").src = picture;
  byId("stage-picture").alt = `${name}: ${words}`;
  byId("stage-words").textContent = `${k + 1} of ${stages.length}: ${name} (${range}). ${words}`;
  byId("stage-back").disabled = k === 0;
  byId("stage-on").disabled = k === stages.length - 1;
}

const at = () => Number(byId("stage-slider").value);
byId("stage-slider").addEventListener("input", () => show(at()));
byId("stage-back").addEventListener("click", () => show(at() - 1));
byId("stage-on").addEventListener("click", () => show(at() + 1));
