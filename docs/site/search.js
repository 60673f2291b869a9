// How the site's search ranks pages, and from where it has the lines that it shows: pages on a disk may not be fetched,
// and search-texts.js brings the texts of all of them.

const asked = () =>
  (new URLSearchParams(window.location.search).get("q") || "").toLowerCase().match(/[\p{L}\p{N}_]{3,}/gu) || [];
const stem = (word) => word.slice(0, Math.max(4, word.length - 2)); // "motors" finds "motor", "fitting" finds "fits"
const REFERENCE = /^(reference|changelog|symbols|formulas|glossary)/;

var Scorer = {
  // A page whose title or name has the words is that of the subject; then comes the one that has the rarest of them most
  // often, and behind the pages come the reference and its names.
  score: ([name, title, , , score, , kind]) => {
    const words = asked().map(stem);
    if (!words.length || kind === "object") return score - 30;
    const [page, section] = title.toLowerCase().split(" > ");
    const text = (SEARCH_TEXTS[name] || "").toLowerCase();
    const share = (has) => words.filter(has).length / words.length;
    const often = Math.min(...words.map((word) => Math.log2(text.split(word).length)));
    const inSection = section ? share((word) => section.includes(word)) : 0;
    const named = share((word) => `${page} ${name}`.includes(word)) + inSection / 4;
    return score + 60 * named + 4 * often - (REFERENCE.test(name) ? 30 : 0);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};

window.fetch = (url) => {
  const name = url.replace(/^.*?\.html$/, (page) => page.slice(0, -".html".length)).replace(/^\.\//, "");
  const main = document.createElement("div");
  main.setAttribute("role", "main");
  main.textContent = SEARCH_TEXTS[name] || "";
  return Promise.resolve({ text: () => Promise.resolve(main.outerHTML) });
};
