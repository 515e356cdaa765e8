"use strict";
// One aspect as a small view of the object: two faces of a cube, or a row of tiles. A unit is that of the graph.

const SIDE = 0.78;
const SHEAR = 0.42;
// Crops to be drawn in place of symbols, by symbol.
let pictures = {};

function face(corners, extra = "") {
  return shape("polygon", { class: `face ${extra}`, points: corners.map((corner) => corner.join(",")).join(" ") });
}

function symbolAt(x, y, symbol) {
  const text = symbol === null ? "?" : String(symbol);
  const fitted = text.length > 3 ? { textLength: 0.54, lengthAdjust: "spacingAndGlyphs" } : {};
  return shape("text", { class: "symbol", x, y, ...fitted }, text);
}

// A symbol on a face, or the picture of it: of the unit square, by an affine map.
function onFace(symbol, matrix, text) {
  return Object.hasOwn(pictures, symbol) ? shape("image", { href: pictures[symbol], width: 1, height: 1,
    preserveAspectRatio: "none", transform: `matrix(${matrix})` }) : text;
}

// The top of a cube is sheared to the right and up; y points downwards in an SVG.
function cube(symbols) {
  const half = (SIDE * (1 + SHEAR)) / 2;
  const deep = SIDE * SHEAR;
  const [left, right, low, high] = [-half, -half + SIDE, half, half - SIDE];
  return [
    face([[right, low], [right + deep, low - deep], [right + deep, high - deep], [right, high]], "side"),
    face([[left, low], [right, low], [right, high], [left, high]]),
    face([[left, high], [right, high], [right + deep, high - deep], [left + deep, high - deep]]),
    onFace(symbols[0], [SIDE, 0, 0, SIDE, left, high], symbolAt((left + right) / 2, (low + high) / 2, symbols[0])),
    onFace(symbols[1], [SIDE, 0, -deep, deep, left + deep, high - deep],
      shape("g", { transform: `translate(${(left + right + deep) / 2} ${high - deep / 2}) scale(1 .72)` },
        symbolAt(0, 0, symbols[1]))),
  ];
}

function tiles(symbols, slots) {
  const side = Math.min(0.6, 1.3 / symbols.length);
  const left = (-side * symbols.length) / 2;
  return symbols.flatMap((symbol, slot) => {
    const [x, y] = [left + slot * side, -side / 2];
    return [
      face([[x, y], [x + side, y], [x + side, y + side], [x, y + side]]),
      onFace(symbol, [side, 0, 0, side, x, y], symbolAt(x + side / 2, 0, symbol)),
      shape("text", { class: "slot", x: x + side / 2, y: y - 0.06 }, slots[slot]),
    ];
  });
}

function isCube(slots) {
  return slots.length === 2 && slots[0] === "front" && slots[1] === "top";
}

function aspect(symbols, slots, kind = "") {
  return shape("g", { class: kind }, isCube(slots) ? cube(symbols) : tiles(symbols, slots));
}

function halo(kind = "") {
  const half = kind === "goal" ? 0.83 : 0.72;
  return shape("rect", { class: `halo ${kind}`, x: -half, y: -half, width: 2 * half, height: 2 * half, rx: 0.18 });
}

function largeAspect(symbols, slots) {
  return shape("svg", { viewBox: "-.95 -.75 1.9 1.5", role: "img", "aria-label": inWords(symbols, slots) },
    aspect(symbols, slots));
}
