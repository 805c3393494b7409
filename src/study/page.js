"use strict";
// Responses of all cases over each other, and a table that can be sorted.

/** From blue over green to orange: `at` from 0 to 1. */
function hueOf(at) {
  const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  return `hsl(${Math.round(212 - 187 * at)} 75% ${dark ? 66 : 40}%)`;
}

/** Names the curve nearest to the pointer, above the chart. */
function namesCurve(place, names) {
  const hint = place.appendChild(document.createElement("div"));
  hint.className = "named";
  return {
    hooks: {
      setSeries: (_, index) => (hint.textContent = index ? names[index - 1] : ""),
    },
  };
}

function responses({ parameters, curves }) {
  const place = byId("response-chart");
  if (!place) return;
  const colourBy = byId("colour-by"), logarithmic = byId("logarithmic"), key = byId("response-key");
  const only = [...document.querySelectorAll("select.only")];
  const chosen = () => curves.filter(({ values }) => only.every((s) => s.value === "" || values[s.dataset.parameter] === Number(s.value)));
  const colour = (all, value) => hueOf(all.length > 1 ? value / (all.length - 1) : 0);
  const chart = new Chart(place, () => {
    const k = colourBy ? Number(colourBy.value) : 0, all = parameters[k]?.values ?? [""];
    const shown = chosen();
    const heights = shown.flatMap((c) => c.amplitude_m).filter((v) => v != null);
    const { factor, unit } = axisUnit("m", heights.reduce((a, b) => Math.max(a, b), 0));
    const lines = shown.map((c) => ({
      x: c.frequency_hz,
      y: c.amplitude_m.map((v) => (v == null ? null : v * factor)),
      series: { label: c.case, stroke: colour(all, c.values[k] ?? 0), width: 1.4, points: { show: false } },
    }));
    place.querySelector(".named")?.remove();
    key.replaceChildren(...all.flatMap((words, v) => {
      if (!shown.some((c) => (c.values[k] ?? 0) === v)) return [];
      const entry = document.createElement("span"), swatch = entry.appendChild(document.createElement("i"));
      swatch.style.background = colour(all, v);
      entry.append(words);
      return [entry];
    }));
    return {
      data: lines.length ? joined(lines) : [[], []],
      series: lines.length ? lines.map((l) => l.series) : [{ label: "" }],
      scales: { y: logarithmic.checked ? { distr: 3 } : {} },
      axes: [{ label: `amplitude (${unit})` }],
      legend: { show: false },
      focus: { alpha: 0.25 },
      cursor: { drag: { x: true, y: false }, focus: { prox: 24 } },
      plugins: [namesCurve(place, shown.map((c) => c.case))],
    };
  });
  for (const tool of [colourBy, logarithmic, ...only]) tool?.addEventListener("change", () => chart.draw());
  drawn.push("responses");
}

/** Sorts the rows by the column whose heading is clicked: numbers by value, the rest by letters. */
function sortable(table) {
  const body = table.tBodies[0];
  [...table.tHead.rows[0].cells].forEach((heading, column) => {
    heading.tabIndex = 0;
    const sort = () => {
      const falls = heading.ariaSort === "ascending", sign = falls ? -1 : 1;
      for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
      heading.ariaSort = falls ? "descending" : "ascending";
      const text = (row) => row.cells[column].textContent.trim().replaceAll("−", "-");
      const compare = (a, b) => {
        const [s, t] = [text(a), text(b)], [v, w] = [s, t].map(parseFloat);
        if (s === "" || t === "") return (s === "") - (t === "");
        return sign * (Number.isNaN(v) || Number.isNaN(w) ? s.localeCompare(t) : v - w);
      };
      body.append(...[...body.rows].sort(compare));
    };
    heading.addEventListener("click", sort);
    heading.addEventListener("keydown", (e) => e.key === "Enter" && sort());
  });
}

responses(data);
document.querySelectorAll("table.sorted").forEach(sortable);
const pictures = [...document.images];
Promise.all(pictures.map((picture) => picture.decode().then(() => drawn.push("picture"), () => {}))).then(() => {
  document.body.dataset.drawn = drawn.join(" ");
});
