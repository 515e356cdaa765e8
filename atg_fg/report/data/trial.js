"use strict";
// The trial that is chosen, at the look that the slider is at.

const data = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("look");
const chooser = document.getElementById("trial");
const onlyWrong = document.getElementById("only-wrong");
let trial = data.trials[0];

function bars(rows) {
  return element("div", { class: "bars" }, rows.map(({ name, share, value, kind = "", nameKind = "" }) => {
    const fill = element("div", { class: `fill ${kind}` });
    fill.style.width = `${100 * Math.min(Math.max(share, 0), 1)}%`;
    return [element("span", { class: `name ${nameKind}`, title: name }, name),
      element("div", { class: "track", "aria-hidden": "true" }, fill), element("span", { class: `value ${nameKind}` }, value)];
  }));
}

function beliefRows(look) {
  const named = look.objects.reduce((sum, [, share]) => sum + share, 0);
  const best = Math.max(look.unseen, ...look.objects.map(([, share]) => share));
  const rows = look.objects.map(([name, share]) =>
    ({ name, share, value: percent(share), nameKind: share === best ? "best" : "" }));
  const others = Math.max(1 - look.unseen - named, 0);
  const othersName = look.objects.length ? "all others remembered" : "remembered ones together";
  if (!look.objects.length || others > 5e-4) rows.push({ name: othersName, share: others, value: percent(others), kind: "quiet" });
  rows.push({ name: "unseen: never met", share: look.unseen, value: percent(look.unseen), kind: "unseen",
    nameKind: look.unseen === best ? "new best" : "new" });
  return rows;
}

function expectedRows(look) {
  const most = Math.max(...promised(look).map(([, value]) => value), 1e-9);
  return promised(look).map(([name, value]) => ({ name: name === look.action ? `${name} – chosen` : name, share: value / most,
    value: value.toFixed(3), kind: name === look.action ? "lit" : "quiet", nameKind: name === look.action ? "best" : "" }));
}

function nextWords(look) {
  const purpose = look.purpose === null ? "" : ` (${look.purpose})`;
  return look.action === null ? `No further action${purpose}.` : `The robot chooses ${look.action}${purpose}.`;
}

function seenWords(look) {
  const shown = look.shown === null || look.shown.join() === look.seen.join() ? "" : ` In truth: ${inWords(look.shown, data.slots)}.`;
  const slipped = look.slipped ? " The last action failed." : "";
  return `${inWords(look.seen, data.slots)}.${shown}${slipped}`;
}

// What the robot takes the object for; only the last look is its verdict.
function verdictParts(look, isLast) {
  const [kind, mark] = !isLast ? ["open", "so far"] : trial.right === null ? ["open", "Verdict"]
    : trial.right ? ["right", "✓ right"] : ["wrong", "✗ wrong"];
  const best = look.unseen > 0.5 ? "a new object" : look.objects.length ? look.objects[0][0] : "one that it remembers";
  return [element("span", { class: `badge ${kind}` }, mark),
    isLast ? `The robot says: ${trial.verdict}. ` : `The robot would say: ${best}. `,
    element("span", { class: "truth" }, `Truth: ${trial.truth}.`)];
}

function drawLook() {
  const now = Number(slider.value);
  const look = trial.looks[now];
  const last = trial.looks.length - 1;
  document.getElementById("position").value = `look ${now} of ${last}`;
  slider.setAttribute("aria-valuetext", `look ${now} of ${last}`);
  for (const [id, off] of [["first", now === 0], ["previous", now === 0], ["next", now === last], ["last", now === last]]) {
    document.getElementById(id).disabled = off;
  }
  show("verdict", verdictParts(look, now === last));
  show("seen-picture", look.frame === null ? largeAspect(look.seen, data.slots)
    : element("img", { src: look.frame, alt: `Camera frame, detected: ${inWords(look.seen, data.slots)}` }));
  show("seen-words", seenWords(look));
  show("graph-title", trial.graphs[look.graph].name);
  show("graph", drawnGraph(data, trial, now));
  show("belief", bars(beliefRows(look)));
  show("entropy", drawnEntropy(data, trial, now));
  document.getElementById("expected-title").hidden = look.expected.length === 0;
  show("expected", look.expected.length ? bars(expectedRows(look)) : null);
  show("next-words", nextWords(look));
  document.querySelectorAll("#looks tbody tr").forEach((row, time) =>
    time === now ? row.setAttribute("aria-current", "step") : row.removeAttribute("aria-current"));
  show("spoken", `Look ${now} of ${last}. ${seenWords(look)} ${nextWords(look)} Entropy ${look.verdict_entropy.toFixed(2)} nats.`);
}

function looksTable() {
  const heads = ["look", "seen", "most probable", "unseen", "entropy, nats", "action", "purpose"];
  const rows = trial.looks.map((look, time) => {
    const [name, share] = look.objects[0] ?? ["–", null];
    const cells = [inWords(look.seen, data.slots), share === null ? "–" : `${name} ${percent(share)}`, percent(look.unseen),
      look.verdict_entropy.toFixed(3), look.action ?? "–", look.purpose ?? "–"];
    return element("tr", {}, element("th", { scope: "row" }, String(time)), cells.map((cell) => element("td", {}, cell)));
  });
  return [element("thead", {}, element("tr", {}, heads.map((head) => element("th", { scope: "col" }, head)))),
    element("tbody", {}, rows)];
}

function drawTrial(index) {
  trial = data.trials[index];
  pictures = trial.thumbnails;
  show("legend", graphLegend(data, trial));
  show("looks", looksTable());
  show("notes", trial.notes.map((note) => element("li", {}, note)));
  document.getElementById("notes").hidden = trial.notes.length === 0;
  slider.max = trial.looks.length - 1;
  slider.value = 0;
  drawLook();
}

function stepTo(now) {
  slider.value = now;
  drawLook();
}

function offerTrials() {
  const chosen = Number(chooser.value || 0);
  const offered = data.trials.map((each, index) => [each, index]).filter(([each]) => !onlyWrong.checked || each.right === false);
  chooser.replaceChildren(...offered.map(([each, index]) => {
    const mark = each.right === null ? "" : each.right ? "✓ " : "✗ ";
    return element("option", { value: index, selected: index === chosen }, `${mark}${each.title}`);
  }));
}

function trialBy(by) {
  const place = chooser.selectedIndex + by;
  if (place >= 0 && place < chooser.options.length) {
    chooser.selectedIndex = place;
    drawTrial(Number(chooser.value));
  }
}

function onKey(event) {
  // Controls and scrolled tables have these keys for themselves.
  if (event.target.closest("input, select, [role=region], summary") || event.ctrlKey || event.altKey || event.metaKey) return;
  const now = Number(slider.value);
  const goal = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: trial.looks.length - 1 }[event.key];
  if (goal === undefined) return;
  event.preventDefault();
  stepTo(goal);
}

slider.addEventListener("input", drawLook);
document.getElementById("first").addEventListener("click", () => stepTo(0));
document.getElementById("previous").addEventListener("click", () => stepTo(Number(slider.value) - 1));
document.getElementById("next").addEventListener("click", () => stepTo(Number(slider.value) + 1));
document.getElementById("last").addEventListener("click", () => stepTo(trial.looks.length - 1));
document.addEventListener("keydown", onKey);
if (chooser) {
  offerTrials();
  onlyWrong.disabled = data.trials.every((each) => each.right !== false);
  onlyWrong.addEventListener("change", () => { offerTrials(); drawTrial(Number(chooser.value)); });
  chooser.addEventListener("change", () => drawTrial(Number(chooser.value)));
  document.getElementById("previous-trial").addEventListener("click", () => trialBy(-1));
  document.getElementById("next-trial").addEventListener("click", () => trialBy(1));
}
drawTrial(0);
