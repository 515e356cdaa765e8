"use strict";
// The ATGs of a memory, side by side.

const data = JSON.parse(document.getElementById("data").textContent);

function pictured(graph, index) {
  const trial = { looks: [{ seen: [null], graph: index }], graphs: data.gallery, goal: null };
  const times = graph.edges.reduce((sum, [, , , count]) => sum + count, 0);
  const words = `${graph.remembered} of ${data.n_aspects} aspects, ${graph.edges.length} edges, seen ${times} times`;
  return element("figure", { class: "card" }, element("figcaption", {}, element("h2", {}, graph.name), words),
    drawnGraph(data, trial, 0));
}

show("gallery", ...data.gallery.map(pictured));
show("legend", data.actions.map((action, index) =>
  element("li", {}, element("span", { class: `swatch s${index % 6}` }), action)));
