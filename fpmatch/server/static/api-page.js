// The API's description, openapi.json, for people.

import { hasToken } from "./api.js";
import { byId, complain, el } from "./dom.js";

let schemas = {};

const resolved = (schema) => (schema?.$ref ? schemas[schema.$ref.split("/").pop()] : schema) ?? {};

function kind(schema) {
  if (schema.$ref) return schema.$ref.split("/").pop();
  if (schema.anyOf) return schema.anyOf.map(kind).filter((name) => name !== "null").join(" or ");
  if (schema.const !== undefined) return JSON.stringify(schema.const);
  if (schema.enum) return schema.enum.map((one) => JSON.stringify(one)).join(" or ");
  if (schema.format === "binary" || schema.contentMediaType) return "file";
  if (schema.type === "array") return `list of ${schema.items ? kind(schema.items) : "values"}`;
  return schema.type ?? "value";
}

// Text in which `words` are code.
function worded(text) {
  return text.split("`").map((part, k) => (k % 2 ? el("code", {}, part) : part));
}

function meaning(schema, required) {
  const parts = [
    schema.description,
    required ? "Required" : "",
    schema.default !== undefined ? `Default: \`${JSON.stringify(schema.default)}\`` : "",
  ];
  return parts.filter(Boolean).join(". ");
}

function table(properties, required, heading) {
  const rows = Object.entries(properties).map(([name, schema]) =>
    [name, kind(schema), meaning(schema, required.includes(name))]);
  const described = rows.some(([, , words]) => words);
  const cell = (...inside) => el("td", {}, ...inside);
  const body = rows.map(([name, what, words]) =>
    el("tr", {}, cell(el("code", {}, name)), cell(what), ...(described ? [cell(...worded(words))] : [])));
  const columns = [heading, "Kind", ...(described ? ["Meaning"] : [])];
  const head = el("tr", {}, ...columns.map((words) => el("th", { scope: "col" }, words)));
  return el("div", { class: "table" }, el("table", {}, el("thead", {}, head), el("tbody", {}, ...body)));
}

function example(path, method, parameters, fields, required) {
  const parts = Object.entries(fields)
    .filter(([name]) => required.includes(name))
    .map(([name, schema]) => `-F ${name}=${kind(schema) === "file" ? "@print.tif" : "…"}`);
  const query = parameters.map(({ name }) => `${name}=…`).join("&");
  const address = `${location.origin}${path.replace("{number}", "1")}`;
  const url = query ? `"${address}?${query}"` : address;
  const token = hasToken() ? ['-H "Authorization: Bearer …"'] : [];
  return ["curl", ...(method === "delete" ? ["-X DELETE"] : []), ...token, ...parts, url].join(" ");
}

function operation(path, method, spec) {
  const content = spec.requestBody?.content ?? {};
  const body = resolved(Object.values(content)[0]?.schema);
  const fields = body.properties ?? {};
  const required = body.required ?? [];
  const parameters = (spec.parameters ?? []).filter((one) => one.in === "query");
  const described = Object.fromEntries(parameters.map((one) => [one.name, one.schema]));
  const success = Object.entries(spec.responses).find(([status]) => status.startsWith("2"));
  const media = success?.[1].content ?? {};
  const answer = resolved(media["application/json"]?.schema);
  const section = el("section", { class: "card" },
    el("h3", {}, `${method.toUpperCase()} ${path}`),
    el("p", {}, ...worded(`${spec.summary}. ${spec.description ?? ""}`)));
  if (parameters.length) section.append(table(described, Object.keys(described), "Parameter"));
  if (Object.keys(fields).length) section.append(table(fields, required, "Field"));
  section.append(el("pre", {}, el("code", {}, example(path, method, parameters, fields, required))));
  if (answer.properties) section.append(table(answer.properties, [], "Answer"));
  else section.append(el("p", {}, `Answer: ${Object.keys(media).join(", ")}`));
  return section;
}

async function show() {
  const answer = await fetch("openapi.json");
  if (!answer.ok) throw new Error("The description of the API cannot be read.");
  const spec = await answer.json();
  schemas = spec.components?.schemas ?? {};
  byId("description").append(...worded(spec.info.description));
  const found = Object.entries(spec.paths).flatMap(([path, methods]) =>
    Object.entries(methods).map(([method, one]) => operation(path, method, one)));
  byId("operations").replaceChildren(...found);
}

show().catch((error) => complain(error.message));
