// The page: which panel is shown, what is dropped where, and what is asked of the server.

import { ApiError, ask, hasToken, setToken } from "./api.js";
import { byId, complain, el, say } from "./dom.js";
import { describeGallery, enrol, identify } from "./gallery.js";
import { comparisonBy, showResult } from "./result.js";
import { Slot } from "./slot.js";
import { lookThrough } from "./stages.js";

const PANELS = ["compare", "identify", "enrol"];
const OPEN_TO = { read: 0, verify: 2, enrol: 3, admin: 3 }; // how many of them
let panels = []; // open to the role of the client, and shown
let about = null;
let running = new AbortController();
const kept = { compare: null, identify: null, enrol: null }; // what each panel's result was

function failed(error) {
  if (error.name === "AbortError") return;
  say("");
  complain(error.message);
  byId("main").classList.remove("pictured");
  if (error instanceof ApiError && error.status === 401) {
    if (!hasToken()) complain(""); // nothing has gone wrong yet
    askForToken();
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
  const stop = el("button", { type: "button", class: "stop" }, "Stop");
  stop.addEventListener("click", () => {
    mine.abort();
    say("Stopped.");
  });
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

const shared = {
  limit: () => about.file_megabytes * 1e6,
  refused: (words) => {
    say("");
    complain(words);
  },
};

function makeSlots() {
  const probe = new Slot(byId("probe-slot"), {
    ...shared, title: "Probe", hint: "Drop an image or a template, or choose a file", changed: compare, stages: lookThrough,
  });
  const reference = new Slot(byId("reference-slot"), {
    ...shared, title: "Reference", hint: "Drop the print to compare it with", changed: compare, stages: lookThrough,
  });
  probe.overflow = (file) => reference.put([file]);
  reference.overflow = (file) => probe.put([file]);

  const fields = () => ({
    probe: probe.file, reference: reference.file, probe_dpi: probe.dpi.value, reference_dpi: reference.dpi.value,
  });

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
      const asked = fields();
      const shown = await (await ask("compare", asked, signal)).json();
      say("");
      probe.tell(shown.probe);
      reference.tell(shown.reference);
      showResult(shown, comparisonBy(asked, ".", async (threshold) => (await ask("verify", { ...asked, threshold })).json()));
    });
  }

  byId("swap").addEventListener("click", () => {
    const [a, b] = [probe.files, reference.files];
    const [x, y] = [probe.dpi.value, reference.dpi.value];
    probe.put(b);
    reference.put(a);
    [probe.dpi.value, reference.dpi.value] = [y, x];
    if (probe.file || reference.file) compare();
  });

  const wanted = new Slot(byId("identify-slot"), {
    ...shared, title: "Probe", hint: "Drop the print to search for, or choose a file", stages: lookThrough,
    changed: () => {
      hideResult();
      run((signal) => identify(wanted, signal));
    },
  });
  const added = new Slot(byId("enrol-slot"), {
    ...shared, title: "Prints to enrol", hint: "Drop images or templates, or choose files", multiple: true,
    changed: () => { byId("enrol-start").disabled = false; },
  });
  byId("enrol-stop").addEventListener("click", () => running.abort());
  byId("enrol-labels").addEventListener("submit", (event) => {
    event.preventDefault();
    run((signal) => enrol(added, signal));
  });

  // A file that misses its place is not opened by the browser in place of this page.
  const active = { compare: probe, identify: wanted, enrol: added };
  window.addEventListener("dragover", (event) => event.preventDefault());
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    const panel = PANELS.find((name) => !byId(`panel-${name}`).hidden);
    const free = panel === "compare" && probe.file && !reference.file ? reference : active[panel];
    free?.take([...event.dataTransfer.files]);
  });
}

function choose(name) {
  const before = PANELS.find((one) => !byId(`panel-${one}`).hidden);
  if (before && before !== name) {
    running.abort();
    kept[before] = [...byId("result").childNodes];
    byId("result").replaceChildren(...(kept[name] ?? []));
    byId("result").hidden = !kept[name]?.length;
    byId("main").classList.toggle("pictured", !byId("result").hidden);
    say("");
    complain("");
  }
  for (const one of PANELS) {
    byId(`panel-${one}`).hidden = one !== name;
    const tab = byId(`tab-${one}`);
    tab.setAttribute("aria-selected", String(one === name));
    tab.tabIndex = one === name ? 0 : -1;
  }
}

for (const name of PANELS) byId(`tab-${name}`).addEventListener("click", () => choose(name));
byId("tabs").addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const now = panels.findIndex((name) => byId(`tab-${name}`).getAttribute("aria-selected") === "true");
  const next = panels[(now + step + panels.length) % panels.length];
  choose(next);
  byId(`tab-${next}`).focus();
});

function askForToken() {
  byId("token-form").hidden = false;
  byId("token").focus();
}

byId("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken(byId("token").value.trim());
  location.reload();
});

async function open() {
  complain("");
  try {
    about = await (await ask("about")).json();
  } catch (error) {
    failed(error);
    return;
  }
  byId("about").textContent = `version ${about.version}${hasToken() ? `, role ${about.role}` : ""}`;
  panels = PANELS.slice(0, Math.min(OPEN_TO[about.role], about.gallery === null ? 1 : PANELS.length));
  byId("tabs").hidden = panels.length < 2;
  for (const name of PANELS) byId(`tab-${name}`).hidden = !panels.includes(name);
  if (panels.length) {
    makeSlots();
    choose("compare");
  }
  const gallery = about.gallery === null ? "" : await describeGallery();
  if (!panels.length) say(`The role of this token is read: it compares no prints. ${gallery}`);
}

open();
