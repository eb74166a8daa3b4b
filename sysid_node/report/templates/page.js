"use strict";
// Draws each plot from the data that lie in it: those on screen first, all of them before printing.
(function () {
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const config = { displaylogo: false, displayModeBar: false, responsive: true };

  function draw(box) {
    const data = box.querySelector("script");
    if (!data) return;
    const figure = JSON.parse(data.textContent);
    data.remove();
    // A finger scrolls the page; only a mouse zooms the plot.
    figure.layout.dragmode = touch ? false : "zoom";
    Plotly.newPlot(box, figure.data, figure.layout, config);
  }

  const boxes = Array.from(document.querySelectorAll(".plot"));
  const watch = new IntersectionObserver(
    (entries) => entries.filter((e) => e.isIntersecting).forEach((e) => { watch.unobserve(e.target); draw(e.target); }),
    { rootMargin: "400px" }
  );
  boxes.forEach((box) => watch.observe(box));
  window.addEventListener("beforeprint", () => boxes.forEach(draw));
})();
