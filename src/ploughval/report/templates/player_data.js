// What the player is given, unpacked: lines and dots in millimetres, force in newtons.
// The entries of a frame: n number, u travel, x blade's face as seen, why lost, unread why its photograph
// is not shown, note of the ledger; P force, s its std, Q predicted;
// b, bs inclination and its std, c predicted; i, j numbers of the bands; L, M layers measured and predicted;
// S, T surfaces; B, C outcrops of the bands; d, m, g dots: places, motion, shear; p photograph.
const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Numbers of seven bits a byte (see player/coding.py).
function numbers(text) {
  const bytes = atob(text), found = [];
  let value = 0, scale = 1;
  for (let i = 0; i < bytes.length; i++) {
    const byte = bytes.charCodeAt(i);
    value += (byte & 127) * scale;
    if (byte < 128) { found.push(value); value = 0; scale = 1; } else scale *= 128;
  }
  return found;
}

const unfold = (value) => (value % 2 ? -(value + 1) / 2 : value / 2);

// Lines as {tag, points: [[x, y], ...]} in mm.
function lines(text, tolerance) {
  if (!text) return [];
  const given = numbers(text), quantum = tolerance / 3, found = [];
  let x = 0, y = 0, at = 0;
  while (at < given.length) {
    const tag = given[at++], points = [];
    for (let left = given[at++]; left > 0; left--) {
      x += unfold(given[at++]);
      y += unfold(given[at++]);
      points.push([x * quantum, y * quantum]);
    }
    found.push({ tag, points });
  }
  return found;
}

// Places of all dots in every frame, [x, y] or null for one that is lost there.
function dots(data) {
  if (!data.dots) return data.frames.map(() => null);
  const { start, quantum } = data.dots, count = start.length / 2, last = [...start];
  return data.frames.map((frame) => {
    if (!frame.d) return null;
    const given = numbers(frame.d), places = [];
    let at = 0;
    for (let k = 0; k < count; k++) {
      const mark = given[at++];
      if (mark === 0) { places.push(null); continue; }
      if (mark > 1) { last[2 * k] += unfold(mark - 2); last[2 * k + 1] += unfold(given[at++]); }
      places.push([last[2 * k] * quantum, last[2 * k + 1] * quantum]);
    }
    return places;
  });
}

// Values of the dots of a frame between 0 and 1, null where not known.
function shares(text) {
  return [...(text ?? "")].map((letter) => { const code = LETTERS.indexOf(letter); return code ? (code - 1) / 62 : null; });
}

// Rows of a curve: {first, u, values: [...]}, null where a value is not known.
function rows(curve) {
  if (!curve) return [];
  const given = numbers(curve.t), sums = new Array(curve.columns + 1).fill(0), found = [];
  for (let at = 0; at < given.length; ) {
    const first = given[at++] === 1;
    const now = sums.map((sum, column) => {
      const mark = given[at++];
      if (mark === 0) return null;
      sums[column] = sum + unfold(mark - 1);
      return sums[column] * curve.steps[column ? 1 : 0];
    });
    found.push({ first, u: now[0], values: now.slice(1) });
  }
  return found;
}

// Round numbers between two ends, at most so many.
function ticks(low, high, most) {
  for (let power = -3; power < 6; power++)
    for (const step of [1, 2, 5]) {
      const size = step * 10 ** power, from = Math.ceil(low / size - 1e-9), to = Math.floor(high / size + 1e-9);
      if (to - from + 1 <= most) return Array.from({ length: Math.max(0, to - from + 1) }, (_, k) => +((from + k) * size).toFixed(6));
    }
  return [];
}

const minus = (text) => String(text).replace("-", "\u2212");

// A number to so many decimals; a dash for one that is not known.
const fixed = (value, digits) => (value === null || value === undefined ? "\u2013" : minus(value.toFixed(digits)));

// A value with its standard uncertainty, both to the second digit of the uncertainty.
function withStd(value, std, digits) {
  if (value === null || !std) return fixed(value, digits);
  const places = Math.max(0, 1 - Math.floor(Math.log10(std)));
  return `${fixed(value, places)} \u00b1 ${fixed(std, places)}`;
}

// An SVG element; entries whose value is null are left out.
function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

Object.assign(window.ploughval.player, { lines, dots, shares, rows, ticks, minus, fixed, withStd, svg });
