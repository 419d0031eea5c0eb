// Prints, minutiae and pairs as layers of a viewer.

import { el, svg } from "./dom.js";
import { minutia } from "./words.js";

// An SVG image covers 0 to its width; the first pixel of a print has its centre at 0.
function image(print, href) {
  return svg("image", {
    href,
    x: -0.5,
    y: -0.5,
    width: print.width,
    height: print.height,
    preserveAspectRatio: "none",
  });
}

export function paper(bounds) {
  return svg("rect", { class: "paper", ...bounds });
}

export function picture(print) {
  return svg("g", { class: "picture" }, image(print, print.picture));
}

export function ink(print, side, move = null) {
  const layer = svg("g", { class: `ink ${side}` }, ...(print.ink ? [image(print, print.ink)] : []));
  if (move) layer.setAttribute("transform", `matrix(${move.matrix.join(" ")})`);
  return layer;
}

// q = t + s R(theta) p, as the transform of a result says it.
export function mover({ scale, rotation_deg: degrees, tx, ty }) {
  const c = scale * Math.cos((degrees * Math.PI) / 180);
  const s = scale * Math.sin((degrees * Math.PI) / 180);
  return {
    matrix: [c, s, -s, c, tx, ty],
    degrees,
    scale,
    point: ([x, y]) => [tx + c * x - s * y, ty + s * x + c * y],
    back: ([x, y]) => [(c * (x - tx) + s * (y - ty)) / scale ** 2, (c * (y - ty) - s * (x - tx)) / scale ** 2],
  };
}

function boxAround(corners, margin) {
  const xs = corners.map(([x]) => x);
  const ys = corners.map(([, y]) => y);
  const [x, y] = [Math.min(...xs) - margin, Math.min(...ys) - margin];
  return { x, y, width: Math.max(...xs) + margin - x, height: Math.max(...ys) + margin - y };
}

export const boundsOf = ({ width, height }) => boxAround([[0, 0], [width, height]], 4);

// The part of a print that shows ridges, moved.
export function extentOf({ extent: [left, top, right, bottom] }, move = null) {
  const corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
  return boxAround(move ? corners.map(move.point) : corners, 14);
}

// The box about both prints, whole.
export function together(a, b) {
  const x = Math.min(a.x, b.x);
  const y = Math.min(a.y, b.y);
  return { x, y, width: Math.max(a.x + a.width, b.x + b.width) - x, height: Math.max(a.y + a.height, b.y + b.height) - y };
}

function shape(kind, r) {
  if (kind === 1) return svg("circle", { r });
  const h = r * 0.886;
  if (kind === 2) return svg("rect", { x: -h, y: -h, width: 2 * h, height: 2 * h });
  return svg("path", { d: `M0 ${-r}L${r} 0L0 ${r}L${-r} 0Z` });
}

// One minutia; `number` is that of its pair, 0 where it has none.
function mark(print, index, side, number, move, labelled) {
  const found = print.minutiae[index];
  const [x, y] = move ? move.point(found) : found;
  const degrees = (-found[2] * 180) / Math.PI + (move ? move.degrees : 0);
  const r = number ? 5.5 : 3.5;
  const tick = svg("line", { x1: r, x2: r + 8 });
  const turned = svg("g", {}, tick, shape(found[3], r));
  turned.style.transform = `rotate(${degrees}deg)`;
  const group = svg("g", { class: `mark ${side} ${number ? "paired" : "lone"}` }, turned);
  group.style.transform = `translate(${x}px, ${y}px) scale(var(--k))`;
  group.prepend(svg("title", {}, `${number ? `pair ${number}: ` : ""}${side} ${minutia(found)}`));
  if (number) {
    group.dataset.pair = number;
    group.prepend(svg("circle", { class: "reach", r: 12 }));
    if (labelled) group.append(svg("text", { x: 9, y: -8, class: "number" }, String(number)));
  }
  return group;
}

export function minutiae(print, side, pairs, move = null, labelled = false) {
  const column = side === "probe" ? 0 : 1;
  const numbers = new Map(pairs.map((pair, k) => [pair[column], k + 1]));
  const indices = print.minutiae.map((_, index) => index);
  const lone = indices.filter((index) => !numbers.has(index));
  const draw = (index) => mark(print, index, side, numbers.get(index) ?? 0, move, labelled);
  return {
    lone: svg("g", { class: `minutiae lone ${side}` }, ...lone.map(draw)),
    paired: svg("g", { class: `minutiae paired ${side}` }, ...[...numbers.keys()].map(draw)),
  };
}

export function links({ pairs, probe, reference }, move = null) {
  const lines = pairs.map(([i, j], k) => {
    const [x1, y1] = move ? move.point(probe.minutiae[i]) : probe.minutiae[i];
    const [x2, y2] = reference.minutiae[j];
    return svg("line", { x1, y1, x2, y2, "data-pair": k + 1 });
  });
  return svg("g", { class: "links" }, ...lines);
}

// The map of ridge agreement.
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
    made.style.left = `${100 * Math.min(Math.max(value, 0), 1)}%`;
    return made;
  };
  const bar = el("div", { class: "scale-bar" }, tick(impostors, "usual"), tick(mean, "mean"));
  bar.style.background = `linear-gradient(90deg, ${colours.join()})`;
  return [el("span", {}, "Ridges differ"), bar, el("span", {}, "coincide")];
}

export const aboutRidges = ({ mean, impostor_mean: impostors, area_mm2: area }) =>
  `Ridge agreement ${mean.toFixed(2)} (thick tick) on ${area.toFixed(0)} mm²; of different fingers ${impostors.toFixed(2)} on average (thin tick). White: not compared.`;
