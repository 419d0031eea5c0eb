// The page: which panel is shown, what is dropped where, and what is asked of the server.

import { ApiError, ask, hasToken, setToken } from "./api.js";
import { button, byId, complain, say } from "./dom.js";
import { describeGallery, enrol, identify } from "./gallery.js";
import { showResult } from "./result.js";
import { Slot } from "./slot.js";
import { lookThrough } from "./stages.js";

const PANELS = ["compare", "identify", "enrol"];
const OPEN_TO = { read: 0, verify: 2, enrol: 3, admin: 3 }; // how many of them
let panel = null; // the one that is shown
let running = new AbortController();
const kept = {}; // what the result of each panel was

function failed(error) {
  if (error.name === "AbortError") return;
  say("");
  complain(error.message);
  byId("main").classList.remove("pictured");
  if (error instanceof ApiError && error.status === 401) {
    if (!hasToken()) complain(""); // nothing has gone wrong yet
    byId("token-form").hidden = false;
    byId("token").focus();
  }
  if (!(error instanceof ApiError)) throw error;
}

// Do one thing at a time: what is under way is stopped, on the server too.
async function run(work) {
  running.abort();
  const mine = new AbortController();
  running = mine;
  complain("");
  byId("main").setAttribute("aria-busy", "true");
  const stop = button("Stop", () => {
    mine.abort();
    say("Stopped.");
  }, { class: "stop" });
  byId("status").after(stop);
  try {
    await work(mine.signal);
  } catch (error) {
    if (running === mine) failed(error);
  } finally {
    stop.remove();
    if (running === mine) byId("main").removeAttribute("aria-busy");
  }
}

function hideResult() {
  byId("result").hidden = true;
  byId("result").replaceChildren();
}

function makeSlots(megabytes) {
  const shared = {
    limit: megabytes * 1e6,
    refused: (words) => {
      say("");
      complain(words);
    },
  };
  const slot = (id, title, hint, changed, more = { stages: lookThrough }) =>
    new Slot(byId(id), { ...shared, title, hint, changed, ...more });
  const probe = slot("probe-slot", "Probe", "Drop an image or a template, or choose a file", compare);
  const reference = slot("reference-slot", "Reference", "Drop the print to compare it with", compare);
  probe.overflow = (file) => reference.put([file]);
  reference.overflow = (file) => probe.put([file]);

  function compare() {
    hideResult();
    byId("intro").hidden = true;
    if (!probe.file || !reference.file) {
      complain("");
      say(`Now the ${probe.file ? "reference" : "probe"}.`);
      return;
    }
    run(async (signal) => {
      say(`Comparing ${probe.file.name} with ${reference.file.name} …`);
      const fields = {
        probe: probe.file, reference: reference.file, probe_dpi: probe.dpi.value, reference_dpi: reference.dpi.value,
      };
      const shown = await (await ask("compare", fields, signal)).json();
      say("");
      probe.tell(shown.probe);
      reference.tell(shown.reference);
      showResult(shown, fields, ".");
    });
  }

  const wanted = slot("identify-slot", "Probe", "Drop the print to search for, or choose a file", () => {
    hideResult();
    run((signal) => identify(wanted, signal));
  });
  const ready = () => { byId("enrol-start").disabled = false; };
  const added = slot("enrol-slot", "Prints to enrol", "Drop images or templates, or choose files", ready, { multiple: true });
  byId("enrol-labels").addEventListener("submit", (event) => {
    event.preventDefault();
    run((signal) => enrol(added, signal));
  });

  // A file that misses its place is not opened by the browser in place of this page.
  window.addEventListener("dragover", (event) => event.preventDefault());
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    const free = probe.file && !reference.file ? reference : probe;
    ({ compare: free, identify: wanted, enrol: added })[panel].take([...event.dataTransfer.files]);
  });
}

function choose(name) {
  if (panel) {
    running.abort();
    kept[panel] = [...byId("result").childNodes];
    byId("result").replaceChildren(...(kept[name] ?? []));
    byId("result").hidden = !kept[name]?.length;
    byId("main").classList.toggle("pictured", !byId("result").hidden);
    say("");
    complain("");
  }
  panel = name;
  for (const one of PANELS) byId(`panel-${one}`).hidden = one !== name;
}

byId("tabs").addEventListener("change", (event) => choose(event.target.value));
byId("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken(byId("token").value.trim());
  location.reload();
});

async function open() {
  const about = await (await ask("about")).json();
  byId("about").textContent = `version ${about.version}${hasToken() ? `, role ${about.role}` : ""}`;
  const panels = PANELS.slice(0, Math.min(OPEN_TO[about.role], about.gallery === null ? 1 : PANELS.length));
  byId("tabs").hidden = panels.length < 2;
  for (const name of PANELS) byId(`tab-${name}`).parentElement.hidden = !panels.includes(name);
  if (panels.length) {
    makeSlots(about.file_megabytes);
    choose("compare");
  }
  const gallery = about.gallery === null ? "" : await describeGallery();
  if (!panels.length) say(`The role of this token is read: it compares no prints. ${gallery}`);
}

open().catch(failed);
