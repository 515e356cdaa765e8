"use strict";
// The ATG of a hypothesis at one look: what was remembered, what the trial has added, and the path so far.

const REACH = 0.68;

// Return the aspects that the looks up to `now` have shown, and the transitions between successive ones.
function pathThrough(trial, graph, now) {
  const aspectOf = new Map(graph.aspects.map((symbols, index) => [symbols.join(), index]));
  const visited = trial.looks.slice(0, now + 1).map((look) =>
    look.seen.includes(null) ? null : aspectOf.get(look.seen.join()) ?? null);
  const steps = [];
  for (let time = 0; time < now; time++) {
    if (visited[time] !== null && visited[time + 1] !== null) {
      steps.push({ from: visited[time], action: trial.looks[time].action, to: visited[time + 1], time });
    }
  }
  return { visited, steps };
}

function edgesOf(graph, path, actions, now) {
  const edges = new Map();
  const edge = (from, action, to) => {
    const key = [from, action, to].join();
    if (!edges.has(key)) edges.set(key, { from, action, to, count: 0, kind: "" });
    return edges.get(key);
  };
  for (const [from, action, to, count] of graph.edges) edge(from, action, to).count = count;
  for (const step of path.steps) {
    const found = edge(step.from, actions.indexOf(step.action), step.to);
    found.kind = step.time === now - 1 || found.kind === "now" ? "now" : "path";
  }
  return [...edges.values()];
}

// A curve that bends to its right, cut off at the borders of both aspects, and its arrow's head.
function arrow(from, to, bend, kind, color, count) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(dx, dy);
  const middle = [(from[0] + to[0]) / 2 - bend * dy, (from[1] + to[1]) / 2 + bend * dx];
  const along = (start, by) => {
    const [x, y] = [middle[0] - start[0], middle[1] - start[1]];
    const far = Math.hypot(x, y) || 1;
    return [start[0] + (by * x) / far, start[1] + (by * y) / far];
  };
  const begin = along(from, Math.min(REACH, length / 3));
  const end = along(to, kind.includes("untried") ? 0.1 : Math.min(REACH, length / 3));
  const curve = shape("path", { class: `edge ${kind}`, d: `M${begin} Q${middle} ${end}` });
  const label = count > 1 ? shape("text", { class: "count", x: (begin[0] + 2 * middle[0] + end[0]) / 4,
    y: (begin[1] + 2 * middle[1] + end[1]) / 4 }, `×${count}`) : null;
  return shape("g", { class: `s${color % 6}` }, curve, kind.includes("untried") ? null : head(end, middle, kind), label);
}

function head(end, before, kind) {
  const size = kind === "now" ? 0.3 : kind === "path" ? 0.22 : 0.15;
  const angle = (Math.atan2(end[1] - before[1], end[0] - before[0]) * 180) / Math.PI;
  return shape("polygon", { class: "head", opacity: kind ? 1 : 0.5, points: `0,0 ${-size},${size / 2.2} ${-size},${-size / 2.2}`,
    transform: `translate(${end}) rotate(${angle})` });
}

// An arrow from an aspect to itself, on its outer side.
function loop(place, number, kind, color, count) {
  const far = Math.hypot(...place) || 1;
  const [ox, oy] = [place[0] / far, place[1] / far];
  const [sx, sy] = [-oy, ox];
  const foot = [place[0] + 0.6 * ox, place[1] + 0.6 * oy];
  const [start, end] = [[foot[0] + 0.2 * sx, foot[1] + 0.2 * sy], [foot[0] - 0.2 * sx, foot[1] - 0.2 * sy]];
  const out = 0.75 + 0.25 * number;
  const control = (side) => [foot[0] + out * ox + side * 0.42 * sx, foot[1] + out * oy + side * 0.42 * sy];
  const curve = shape("path", { class: `edge ${kind}`, d: `M${start} C${control(1)} ${control(-1)} ${end}` });
  const label = count > 1 ? shape("text", { class: "count", x: foot[0] + 0.75 * out * ox, y: foot[1] + 0.75 * out * oy },
    `×${count}`) : null;
  return shape("g", { class: `s${color % 6}` }, curve, head(end, control(-1), kind), label);
}

// Return how much an arrow bends: little, but so that it keeps clear of other aspects and of the node in the middle.
function clearBend(from, to, bend, places, hasMiddle) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const control = (by) => [(from[0] + to[0]) / 2 - by * dy, (from[1] + to[1]) / 2 + by * dx];
  const at = (by, t) => [0, 1].map((axis) =>
    (1 - t) ** 2 * from[axis] + 2 * t * (1 - t) * control(by)[axis] + t ** 2 * to[axis]);
  const others = places.filter((place) => place !== from && place !== to);
  const hits = (point) => others.filter(([x, y]) => Math.hypot(point[0] - x, point[1] - y) < 0.8).length
    + (hasMiddle && Math.abs(point[0]) < 1.2 && Math.abs(point[1]) < 0.6 ? 2 : 0);
  const cost = (by) => Math.abs(by - bend) + [0.3, 0.4, 0.5, 0.6, 0.7].reduce((sum, t) => sum + hits(at(by, t)), 0);
  const bends = [0, 0.15, 0.3, 0.45, 0.6, -0.3, -0.45, -0.6, -0.75].map((more) => bend + more);
  return bends.reduce((best, by) => (cost(by) < cost(best) ? by : best));
}

function drawnEdges(edges, places, hasMiddle) {
  const between = new Map();
  const bend = (edge) => {
    const key = [edge.from, edge.to].join();
    const number = between.get(key) ?? 0;
    between.set(key, number + 1);
    return number;
  };
  // What is lit is drawn last, above the others.
  const order = ["", "path", "now"];
  return edges.toSorted((a, b) => order.indexOf(a.kind) - order.indexOf(b.kind)).map((edge) => {
    const [from, to, number] = [places[edge.from], places[edge.to], bend(edge)];
    if (edge.from === edge.to) return loop(from, number, edge.kind, edge.action, edge.count);
    const bent = clearBend(from, to, 0.12 + 0.1 * number, places, hasMiddle);
    return arrow(from, to, bent, edge.kind, edge.action, edge.count);
  });
}

// Dotted lines to the node of all aspects that are not known, one for each action never tried.
function untried(known, edges, places, actions) {
  const tried = new Set(edges.map((edge) => [edge.from, edge.action].join()));
  return known.flatMap((index) => actions.flatMap((_, action) => tried.has([index, action].join()) ? []
    : [arrow(places[index], [0, 0], 0.1 * (action - (actions.length - 1) / 2), "untried", action, 0)]));
}

function collection(count) {
  return [
    shape("rect", { class: "rest", x: -1.05, y: -0.42, width: 2.1, height: 0.84, rx: 0.2 }),
    shape("text", { class: "rest-words", y: -0.06 }, "collection node"),
    shape("text", { class: "rest-words", y: 0.27 }, `${count} unobserved`),
  ];
}

// Return the drawing of the graph of the look `now`, and what it shows in words.
function drawnGraph(data, trial, now) {
  const look = trial.looks[now];
  const graph = trial.graphs[look.graph];
  const path = pathThrough(trial, graph, now);
  const known = graph.aspects.map((_, index) => index).filter((index) => index < graph.remembered || path.visited.includes(index));
  const places = graph.places.map(([x, y]) => [x, -y]);
  const edges = edgesOf(graph, path, data.actions, now);
  const unobserved = data.n_aspects - known.length;
  const extent = Math.max(...places.map((place) => Math.hypot(...place)), 1.2) + 1.25;
  const current = path.visited[now];
  const nodes = known.map((index) => {
    const kind = [index >= graph.remembered ? "new" : "", path.visited.includes(index) ? "" : "quiet"].join(" ");
    const goal = trial.goal !== null && trial.goal.every((symbol, slot) => symbol === null || symbol === graph.aspects[index][slot]);
    return shape("g", { transform: `translate(${places[index]})` },
      shape("title", {}, inWords(graph.aspects[index], data.slots)), aspect(graph.aspects[index], data.slots, kind),
      goal ? halo("goal") : null, index === current ? halo() : null);
  });
  const shown = current === null ? "the current aspect is not known" : `current aspect ${inWords(graph.aspects[current], data.slots)}`;
  const words = `${graph.name}: ${known.length} aspects known, ${unobserved} unobserved; ${shown}`;
  const parts = [
    ...(unobserved > 0 ? untried(known, edges, places, data.actions) : []),
    ...drawnEdges(edges, places, unobserved > 0), ...(unobserved > 0 ? collection(unobserved) : []), ...nodes,
  ];
  const box = [-extent, -extent, 2 * extent, 2 * extent].map((value) => value.toFixed(2)).join(" ");
  return shape("svg", { viewBox: box, role: "img", "aria-label": words }, ...parts);
}

function graphLegend(data, trial) {
  const items = data.actions.map((action, index) => [`swatch s${index % 6}`, action]);
  items.push(["swatch thick", "path so far"], ["swatch dotted", "not yet tried"], ["swatch box", "current aspect"]);
  items.push(["swatch box new", "new in this trial"]);
  if (trial.goal !== null) items.push(["swatch box goal", `goal: ${inWords(trial.goal, data.slots).replaceAll("not seen", "any")}`]);
  return items.map(([kind, words]) => element("li", {}, element("span", { class: kind }), words));
}
