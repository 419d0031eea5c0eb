// The map of ridge agreement.

import { el, svg } from "./dom.js";

const clamped = (value) => Math.min(Math.max(value, 0), 1);

export function cells({ cell_px: side, rotation_deg: degrees, cells: found }) {
  return svg("g", { class: "cells" }, ...found.map(([x, y, value, colour]) => svg(
    "rect",
    {
      x: x - side / 2, y: y - side / 2, width: side, height: side, fill: colour, stroke: colour,
      transform: `rotate(${degrees} ${x} ${y})`,
    },
    svg("title", {}, `ridge agreement ${value.toFixed(2)}`),
  )));
}

// The scale of colours, with ticks at the mean of different fingers and at this comparison.
export function scale({ mean, impostor_mean: impostors, colours }) {
  const tick = (value, name) => {
    const made = el("i", { class: name });
    made.style.left = `${100 * clamped(value)}%`;
    return made;
  };
  const bar = el("div", { class: "scale-bar" }, tick(impostors, "usual"), tick(mean, "mean"));
  bar.style.background = `linear-gradient(90deg, ${colours.join()})`;
  return [el("span", {}, "Ridges differ"), bar, el("span", {}, "coincide")];
}

export const aboutRidges = ({ mean, impostor_mean: impostors, area_mm2: area }) =>
  `Ridge agreement ${mean.toFixed(2)} (thick tick) on ${area.toFixed(0)} mm²; of different fingers ${impostors.toFixed(2)} on average (thin tick). White: not compared.`;
