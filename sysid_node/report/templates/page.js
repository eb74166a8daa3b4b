"use strict";
// Draws each plot from the data that lie in it, one after another, so that the page can be read meanwhile. Colours
// follow the page's: light, dark, and always light on paper. Each figure has a link to the numbers that it draws.
(function () {
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const night = window.matchMedia("(prefers-color-scheme: dark)");
  const config = { displaylogo: false, displayModeBar: false, responsive: true };
  // A plot in a closed part of the page waits until that is opened: it has no width yet, and there may be hundreds.
  const closed = (box) => box.closest("details:not([open])") !== null;
  const waiting = Array.from(document.querySelectorAll(".plot")).filter((box) => !closed(box));
  const drawn = new Map(); // plot -> text of its figure
  // Colours of figures.py, and what they are on a dark page.
  const dark = {
    "#0072B2": "#4aa8e0", "#D55E00": "#f08030", "#009E73": "#25c49a", "#AA4499": "#d07cc4", "#1f2933": "#e3e8ee",
    "#8a94a0": "#95a0ad", "#bcc5cf": "#66717e", "#e6eaef": "#2a313a", "#b8c0ca": "#56616e", "#999999": "#a8b0b8",
  };

  function figureOf(text, darkened) {
    const coloured = darkened ? text.replace(/#[0-9a-fA-F]{6}/g, (colour) => dark[colour] || colour) : text;
    const figure = JSON.parse(coloured);
    // A finger scrolls the page; only a mouse zooms the plot.
    figure.layout.dragmode = touch ? false : "zoom";
    return figure;
  }

  function draw(box) {
    const data = box.querySelector("script");
    drawn.set(box, data.textContent);
    data.remove();
    const figure = figureOf(drawn.get(box), night.matches);
    Plotly.newPlot(box, figure.data, figure.layout, config);
    box.insertAdjacentElement("afterend", linkTo(box));
  }

  function redraw(darkened, width) {
    for (const [box, text] of drawn) {
      const figure = figureOf(text, darkened);
      if (width) figure.layout.width = width(box);
      Plotly.react(box, figure.data, figure.layout, config);
    }
  }

  // The link to a figure's numbers, made when it is asked for: curve, horizontal and vertical value, a row a point.
  function linkTo(box) {
    const link = document.createElement("a");
    link.className = "data";
    link.textContent = "data (CSV)";
    link.href = "#";
    link.addEventListener("click", () => {
      const label = box.getAttribute("aria-label") || "figure";
      link.download = label.toLowerCase().replace(/[^a-z0-9]+/g, "_").slice(0, 60) + ".csv";
      link.href = URL.createObjectURL(new Blob([csvOf(JSON.parse(drawn.get(box)))], { type: "text/csv" }));
    });
    return link;
  }

  function csvOf(figure) {
    const title = (axis) => ((figure.layout[axis] || {}).title || {}).text || axis[0];
    const cell = (value) => (typeof value === "number" ? (isNaN(value) ? "" : String(value)) : '"' + String(value).replace(/"/g, '""') + '"');
    const rows = [["curve", title("xaxis"), title("yaxis")].map(cell).join(",")];
    for (const trace of figure.data) {
      const x = numbers(trace.x), y = numbers(trace.y);
      for (let i = 0; i < x.length; i++) rows.push([trace.name || "", x[i], y[i]].map(cell).join(","));
    }
    return rows.join("\n") + "\n";
  }

  function numbers(values) {
    if (!values || !values.bdata) return Array.from(values || []);
    const bytes = Uint8Array.from(atob(values.bdata), (letter) => letter.charCodeAt(0));
    return Array.from(new Float32Array(bytes.buffer));
  }

  function drawNext() {
    if (waiting.length === 0) return;
    draw(waiting.shift());
    setTimeout(drawNext, 0);
  }

  for (const part of document.querySelectorAll("details")) {
    part.addEventListener("toggle", () => {
      for (const box of part.querySelectorAll(".plot")) if (part.open && !drawn.has(box) && !closed(box)) draw(box);
    });
  }
  // A link into a closed part opens it.
  function openTarget() {
    const part = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (part && part.tagName === "DETAILS") part.open = true;
  }
  window.addEventListener("hashchange", openTarget);
  openTarget();

  night.addEventListener("change", () => redraw(night.matches));
  window.addEventListener("beforeprint", () => {
    waiting.splice(0).forEach(draw);
    // A page of A4 between its margins is 182 mm wide, 688 px; two plots stand beside each other.
    redraw(false, (box) => (box.closest(".grid") ? 330 : 680));
  });
  window.addEventListener("afterprint", () => redraw(night.matches));
  drawNext();
})();
