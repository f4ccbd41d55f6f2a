// What is shown, as files: figures as SVG that stand alone, tables and curves as CSV. No request is made.
const root = document.documentElement;
const SVG = "http://www.w3.org/2000/svg";
const FONT = 'Arial, Helvetica, "DejaVu Sans", sans-serif';
const STYLED = new Set(["fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity",
  "stroke-dasharray", "stroke-dashoffset", "stroke-linejoin", "stroke-linecap", "opacity", "font-family",
  "font-size", "font-weight", "font-style", "text-anchor", "dominant-baseline", "paint-order",
  "image-rendering", "mix-blend-mode", "visibility", "vector-effect"]);
const NEVER_DRAWN = "defs, defs *, symbol, symbol *, clipPath, clipPath *, style, title, desc, metadata";

// The rules of the page's own style sheets that hold on this screen.
function* rules(list) {
  for (const rule of list) {
    if (rule.selectorText) yield rule;
    else if (rule.media && matchMedia(rule.media.mediaText).matches) yield* rules(rule.cssRules);
  }
}

// Custom properties as the page's light theme has them: those of :root outside any media query.
function lightTheme() {
  const theme = new Map();
  for (const sheet of document.styleSheets)
    for (const rule of sheet.cssRules)
      if (rule.selectorText === ":root")
        for (const name of rule.style) if (name.startsWith("--")) theme.set(name, rule.style.getPropertyValue(name).trim());
  theme.set("--font", FONT);
  return theme;
}

function resolved(text, theme) {
  return text.replace(/var\((--[\w-]+)\)/g, (all, name) => theme.get(name) ?? "currentColor");
}

// What the page's style sheets say of an element and of what is in it, taken over as style of the copy; style
// sheets within a drawing go with it.
function inline(svg, copy, theme) {
  const sheets = [...document.styleSheets].filter((sheet) => !sheet.ownerNode.closest("svg"))
    .flatMap((sheet) => [...rules(sheet.cssRules)])
    .map((rule) => [rule.selectorText, [...rule.style].filter((name) => STYLED.has(name))])
    .filter(([selector, names]) => names.length && !/:(hover|focus|active)/.test(selector));
  const from = [svg, ...svg.querySelectorAll("*")], to = [copy, ...copy.querySelectorAll("*")], gone = [];
  from.forEach((element, i) => {
    const names = sheets.filter(([selector]) => element.matches(selector)).flatMap(([, declared]) => declared);
    const style = getComputedStyle(element);
    for (const name of new Set(names)) to[i].style.setProperty(name, style.getPropertyValue(name));
    if (i && style.display === "none" && !element.matches(NEVER_DRAWN)) gone.push(to[i]);
    if (element.localName === "style") to[i].textContent = resolved(element.textContent, theme);
    for (const { name, value } of [...to[i].attributes])
      if (value.includes("var(")) to[i].setAttribute(name, resolved(value, theme));
  });
  for (const element of gone) element.remove();
}

// The drawing as the text of an SVG file: light theme, size in points, name and description within.
function svgText(svg) {
  const theme = lightTheme(), copy = svg.cloneNode(true), was = svg.getAttribute("style");
  for (const [name, value] of theme) svg.style.setProperty(name, value);
  const ground = getComputedStyle(svg).backgroundColor, ink = theme.get("--ink");
  inline(svg, copy, theme);
  if (was === null) svg.removeAttribute("style"); else svg.setAttribute("style", was);

  const box = svg.viewBox.baseVal, size = svg.getBoundingClientRect();
  const [x, y, width, height] = box && box.width ? [box.x, box.y, box.width, box.height] : [0, 0, size.width, size.height];
  copy.setAttribute("xmlns", SVG);
  copy.setAttribute("viewBox", [x, y, width, height].join(" "));
  copy.setAttribute("width", `${width}pt`);
  copy.setAttribute("height", `${height}pt`);
  copy.setAttribute("color", ink);
  for (const name of ["tabindex", "aria-label", "aria-labelledby", "aria-describedby", "style"]) copy.removeAttribute(name);
  if (!/^(transparent|rgba\(.*, 0\))$/.test(ground)) copy.prepend(part("rect", { x, y, width, height, fill: ground }));
  const caption = svg.closest("figure")?.querySelector("figcaption")?.textContent.trim();
  const said = [svg.getAttribute("aria-label"), caption].filter(Boolean).join(" ");
  for (const old of copy.querySelectorAll(":scope > title, :scope > desc")) old.remove();
  if (said) copy.prepend(part("desc", {}, said));
  copy.prepend(part("title", {}, document.title));
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(copy)}\n`;
}

function part(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

// Rows of numbers and texts as CSV (RFC 4180). A text that a spreadsheet would run as a formula gets a '.
function csv(rows) {
  return rows.map((row) => row.map(csvCell).join(",") + "\r\n").join("");
}

function csvCell(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "";
  if (typeof value === "number") return String(value);
  let text = String(value).trim();
  if (/^[=+\-@]/.test(text) && !/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text)) text = `'${text}`;
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

// Hands a file to the browser's downloads. Spreadsheets need a mark to read letters beyond ASCII as UTF-8.
function save(name, type, text) {
  const mark = type.startsWith("text/csv") && /[^\x00-\x7f]/.test(text) ? "\ufeff" : "";
  const address = URL.createObjectURL(new Blob([mark, text], { type: `${type};charset=utf-8` }));
  const link = document.createElement("a");
  link.href = address;
  link.download = fileName(name);
  link.hidden = true;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

// A name that every file system takes: letters, digits, dashes and dots, begun by the test's name.
function fileName(name) {
  const test = clean(document.querySelector("h1")?.textContent ?? "").slice(0, 60) || "test";
  const at = name.lastIndexOf("."), ending = at > 0 ? clean(name.slice(at + 1)) : "";
  return `${test}-${clean(at > 0 ? name.slice(0, at) : name) || "figure"}${ending && `.${ending}`}`;
}

function clean(text) {
  return text.normalize("NFC").replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-+|-+$/g, "");
}

// The one name that the scripts of the page share; `player` is filled by those of the player.
window.ploughval = Object.freeze({ save, svgText, csv, player: {} });

// Marks the page as one whose scripts run; what needs them is shown from then on.
root.classList.add("scripted");

// The controls of the page: each names what it saves.
document.addEventListener("click", (event) => {
  const button = event.target.closest("button[data-save]");
  if (!button) return;
  const place = button.closest("[data-name]"), what = button.dataset.save;
  if (what === "svg") save(`${place.dataset.name}.svg`, "image/svg+xml", svgText(place.querySelector(":scope > svg")));
  else if (what === "table") save(`${place.dataset.name}.csv`, "text/csv", csv(tableRows(place.querySelector("table"), place)));
  else {
    const { name, text } = JSON.parse(document.getElementById("attached").textContent)[button.dataset.file];
    save(name, "text/csv", text);
  }
});

// Rows of a table: numbers in full precision, uncertainties in columns of their own, notes in words.
function tableRows(table, place) {
  const notes = [...place.querySelectorAll(".footnotes > li")].map((note) => note.textContent.trim());
  const rows = [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cellContent(cell, notes)));
  const head = [...(table.tHead?.rows[0].cells ?? [])].map((cell) => cell.textContent.trim());
  const width = Math.max(0, ...rows.map((row) => row.length));
  const paired = Array.from({ length: width }, (_, i) => rows.some((row) => row[i]?.[1] !== undefined));
  const body = rows.map((row) => row.flatMap((cell, i) => (paired[i] ? [cell[0], cell[1]] : [cell[0]])));
  return head.length ? [head.flatMap((name, i) => (paired[i] ? pairNames(name) : [name])), ...body] : body;
}

// "Force ± std, N" is two columns: "Force, N" and "std of Force, N".
function pairNames(name) {
  const [, what, spread, rest] = /^(.*?) ± (\w+)(.*)$/.exec(name) ?? [name, name, "std", ""];
  return [what + rest, `${spread} of ${what}${rest}`];
}

function cellContent(cell, notes) {
  const number = cell.querySelector("data"), text = cell.textContent.trim();
  if (number) return [Number(number.value), number.dataset.std === undefined ? undefined : Number(number.dataset.std)];
  if (text === "–") return [null];
  return [notes[letters(text)] ?? text];
}

// Place of a footnote from its letter: a, b, ... z, aa; -1 where a text is none.
function letters(text) {
  return /^[a-z]{1,2}$/.test(text) ? [...text].reduce((sum, letter) => sum * 26 + letter.charCodeAt(0) - 96, 0) - 1 : -1;
}
