// The stages of an extraction, to look through.

import { ask } from "./api.js";
import { byId, complain, say } from "./dom.js";

let stages = [];

export async function lookThrough(slot) {
  say(`Extracting ${slot.file.name} stage by stage …`);
  complain("");
  try {
    const shown = await (await ask("stages", { image: slot.file, dpi: slot.dpi.value })).json();
    stages = shown.stages;
    byId("stages-title").textContent = `Stages of ${shown.name}`;
    byId("stage-slider").max = stages.length - 1;
    byId("stage-slider").value = stages.length - 1;
    show();
    byId("stages").showModal();
    byId("stage-slider").focus();
  } catch (error) {
    complain(error.message);
  } finally {
    say("");
  }
}

function show() {
  const k = Number(byId("stage-slider").value);
  const { name, words, range, picture } = stages[k];
  byId("stage-slider").setAttribute("aria-valuetext", name);
  byId("stage-picture").src = picture;
  byId("stage-picture").alt = `${name}: ${words}`;
  byId("stage-words").textContent = `${k + 1} of ${stages.length}: ${name} (${range}). ${words}`;
}

byId("stage-slider").addEventListener("input", show);
