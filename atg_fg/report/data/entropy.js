"use strict";
// The entropy of the verdict over the looks of a trial, with what each action was expected to leave.

const CHART = { width: 640, height: 240, left: 46, right: 14, top: 12, bottom: 34 };

// What each action was expected to leave of it. Which one of all objects that were never met it is, no look is expected
// to tell, so that both entropies have as much of that.
function promised(look) {
  const more = look.entropy - look.verdict_entropy;
  return look.expected.map(([action, value]) => [action, Math.max(value - more, 0)]);
}

function entropyScale(trial) {
  const values = trial.looks.flatMap((look) => [look.verdict_entropy, ...promised(look).map(([, value]) => value)]);
  const top = values.reduce((most, value) => Math.max(most, value), 0.1) * 1.06;
  const last = Math.max(trial.looks.length - 1, 1);
  return {
    top,
    x: (time) => CHART.left + 8 + (time / last) * (CHART.width - CHART.left - CHART.right - 16),
    y: (value) => CHART.height - CHART.bottom - (value / top) * (CHART.height - CHART.top - CHART.bottom),
  };
}

function entropyAxes(trial, scale) {
  const step = scale.top > 2.5 ? 1 : scale.top > 1 ? 0.5 : 0.1;
  const lines = [];
  for (let value = 0; value <= scale.top; value += step) {
    const y = scale.y(value);
    lines.push(shape("line", { class: "grid", x1: CHART.left, x2: CHART.width - CHART.right, y1: y, y2: y }));
    lines.push(shape("text", { class: "tick", x: CHART.left - 8, y: y + 4, "text-anchor": "end" }, String(+value.toFixed(1))));
  }
  const every = Math.ceil(trial.looks.length / 14);
  trial.looks.forEach((_, time) => {
    if (time % every === 0) {
      const place = { class: "tick", x: scale.x(time), y: CHART.height - 16, "text-anchor": "middle" };
      lines.push(shape("text", place, String(time)));
    }
  });
  lines.push(shape("text", { class: "label", x: CHART.width - CHART.right, y: CHART.height - 2, "text-anchor": "end" }, "look"));
  lines.push(shape("text", { class: "label", x: 4, y: 11 }, "nats"));
  return lines;
}

// Of a long trial not every look is drawn, but the one that is shown, always.
const DRAWN = 400;
const isDrawn = (trial, time, now) => time === now || time % Math.ceil(trial.looks.length / DRAWN) === 0;

// The expectation of an action stands at the look that follows it; the chosen one is filled.
function promises(data, trial, scale, now) {
  return trial.looks.flatMap((look, time) => !isDrawn(trial, time, now) ? [] : promised(look).map(([action, value]) => {
    const color = data.actions.indexOf(action);
    const x = scale.x(Math.min(time + 1, Math.max(trial.looks.length - 1, 1))) + 7 * (color - (data.actions.length - 1) / 2);
    const kind = action === look.action ? "promise chosen" : "promise";
    return shape("g", { class: `s${color % 6}` }, shape("title", {}, `${action}: ${value.toFixed(3)} expected`),
      shape("circle", { class: kind, cx: x, cy: scale.y(value), r: 3.4 }));
  }));
}

function drawnEntropy(data, trial, now) {
  const scale = entropyScale(trial);
  const points = trial.looks.map((look, time) => [scale.x(time), scale.y(look.verdict_entropy)]);
  const dots = points.map(([cx, cy], time) => !isDrawn(trial, time, now) ? null : shape("circle",
    { class: time === now ? "h-dot now" : "h-dot", cx, cy, r: time === now ? 6.5 : 3.2 }));
  const cursor = { class: "cursor", x1: points[now][0], x2: points[now][0], y1: CHART.top, y2: CHART.height - CHART.bottom };
  const told = trial.looks.filter((_, time) => isDrawn(trial, time, now)).map((look) => look.verdict_entropy.toFixed(2));
  const words = `Entropy of the verdict: ${told.join(", ")} nats`;
  return shape("svg", { viewBox: `0 0 ${CHART.width} ${CHART.height}`, role: "img", "aria-label": words },
    ...entropyAxes(trial, scale), shape("line", cursor), shape("path", { class: "h-line", d: `M${points.join(" L")}` }),
    promises(data, trial, scale, now), dots);
}
