"use strict";
// Draws each plot from the data that lie in it, one after another, so that the page can be read meanwhile.
(function () {
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const config = { displaylogo: false, displayModeBar: false, responsive: true };
  const waiting = Array.from(document.querySelectorAll(".plot"));

  function draw(box) {
    const data = box.querySelector("script");
    const figure = JSON.parse(data.textContent);
    data.remove();
    // A finger scrolls the page; only a mouse zooms the plot.
    figure.layout.dragmode = touch ? false : "zoom";
    Plotly.newPlot(box, figure.data, figure.layout, config);
  }

  function drawNext() {
    if (waiting.length === 0) return;
    draw(waiting.shift());
    setTimeout(drawNext, 0);
  }

  window.addEventListener("beforeprint", () => waiting.splice(0).forEach(draw));
  drawNext();
})();
