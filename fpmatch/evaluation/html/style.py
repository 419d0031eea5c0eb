"""The page's looks: one column, light or dark as the reader's system has it, ready to print."""

from __future__ import annotations

from typing import Final

LIGHT: Final = {
    "paper": "#ffffff",
    "card": "#f5f6f8",
    "ink": "#1a1d21",
    "muted": "#626a73",
    "grid": "#e3e6ea",
    "shade": "#f0ece2",
    "genuine": "#00725a",
    "impostor": "#b8441a",
    "good": "#00725a",
    "bad": "#a8221c",
    "series-0": "#0a5fb4",
    "series-1": "#c45a00",
    "series-2": "#00806a",
    "series-3": "#a8327d",
    "series-4": "#6b5b00",
    "series-5": "#4a3fb5",
    "series-6": "#b3261e",
    "series-7": "#4d5761",
}
DARK: Final = {
    "paper": "#14171a",
    "card": "#1e2226",
    "ink": "#e8eaed",
    "muted": "#9aa3ad",
    "grid": "#2d3339",
    "shade": "#28261f",
    "genuine": "#35c9a5",
    "impostor": "#ff8a57",
    "good": "#35c9a5",
    "bad": "#ff7b72",
    "series-0": "#6cb2ff",
    "series-1": "#ffa657",
    "series-2": "#41d1b0",
    "series-3": "#f08bc8",
    "series-4": "#d8c34a",
    "series-5": "#a99cff",
    "series-6": "#ff7b72",
    "series-7": "#aab4bf",
}
_RULES: Final = """
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 84rem; background: var(--paper);
  color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; margin: 0 0 .25rem; }
h2 { font-size: 1.3rem; margin: 2.75rem 0 .5rem; border-top: 1px solid var(--grid);
  padding-top: 1.25rem; }
h3 { font-size: 1.05rem; margin: 1.75rem 0 .5rem; }
p, ul { max-width: 48rem; margin: .4rem 0; }
ul { padding-left: 1.2rem; }
.note, figcaption { color: var(--muted); font-size: .88rem; }
.scrolls { overflow-x: auto; margin: .75rem 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }
th, td { padding: .3rem .55rem; text-align: right; border-bottom: 1px solid var(--grid);
  white-space: nowrap; vertical-align: top; }
th:first-child { text-align: left; padding-left: 0; }
thead th { color: var(--muted); font-weight: 600; }
tbody th { font-weight: 400; }
tr.strong > * { font-weight: 600; }
td small { display: block; color: var(--muted); font-weight: 400; font-size: .78rem; }
.good { color: var(--good); } .bad { color: var(--bad); }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(27rem, 100%), 1fr));
  gap: 1.25rem 2rem; margin: .75rem 0; }
.worst { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr));
  gap: 1rem; margin: .75rem 0; }
figure { margin: 0; }
.worst figure { background: var(--card); border-radius: 8px; padding: .75rem; }
.worst img { width: 100%; border-radius: 4px; display: block; background: #fff; }
.worst input { position: absolute; opacity: 0; }
.worst img { cursor: zoom-in; }
.worst input:focus-visible + img { outline: 3px solid var(--series-0); }
.worst input:checked + img { cursor: zoom-out; position: fixed; inset: 0; z-index: 1;
  width: 100vw; height: 100vh; object-fit: contain; border-radius: 0; background: #000d; }
.worst figcaption { margin-top: .5rem; }
.worst figcaption b { color: var(--ink); }
.worst figcaption ul { margin: .25rem 0 0; }
svg[role=img] { width: 100%; height: auto; display: block; }
svg text { font-family: system-ui, sans-serif !important; }
.legend { display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; margin: .5rem 0; padding: 0;
  list-style: none; font-size: .9rem; max-width: none; }
.legend svg { width: 2.2rem; height: .7rem; vertical-align: middle; margin-right: .4rem; }
a { color: var(--series-0); }
@media print { body { max-width: none; padding: 0; } figure { break-inside: avoid; } }
"""


def stylesheet() -> str:
    """Return the CSS of the page."""
    return (
        f":root {{ color-scheme: light dark; {_variables(LIGHT)} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root {{ {_variables(DARK)} }} }}\n{_RULES}"
    )


def _variables(colours: dict[str, str]) -> str:
    return " ".join(f"--{name}: {colour};" for name, colour in colours.items())
