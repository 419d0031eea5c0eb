// Elements, without a line of HTML in strings: what people or files say never becomes markup.

const SVG = "http://www.w3.org/2000/svg";

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

export function el(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

export function svg(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

// A button, and a box to tick with its words.
export const button = (words, onclick, attributes = {}) => el("button", { type: "button", onclick, ...attributes }, words);

export function tick(words, onchange, attributes = {}) {
  const box = el("input", { type: "checkbox", onchange: () => onchange(box.checked), ...attributes });
  return el("label", { class: "tick" }, box, words);
}

export const byId = (id) => document.getElementById(id);

export function say(words) {
  byId("status").textContent = words;
}

export function complain(words) {
  byId("error").textContent = words;
}

export function save(blob, name) {
  const url = URL.createObjectURL(blob);
  const link = el("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
