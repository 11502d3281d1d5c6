// Search without a server: search-index.js, a list of [address, title, text], is read with the first key. Pages that hold every word
// are listed, those that have them in their titles first.
(() => {
  const root = document.currentScript.dataset.root;
  const input = document.querySelector("header input"), found = document.getElementById("found");
  let asked = false;
  const load = () => {
    if (asked) return;
    asked = true;
    const script = document.createElement("script");
    script.src = root + "/search-index.js";
    script.onload = search;
    document.head.append(script);
  };
  const worth = ([address, title, text], words) => {
    let sum = 0;
    const name = title.toLowerCase(), body = text.toLowerCase();
    for (const word of words) {
      const inTitle = name.includes(word), inText = body.includes(word);
      if (!inTitle && !inText) return 0;
      sum += inTitle ? (name === word ? 40 : name.startsWith(word) ? 20 : 10) : 1 + Math.min(4, body.split(word).length / 4);
    }
    return sum * (address.startsWith("reference/") && !address.startsWith("reference/vtk") ? 0.5 : 1) + (address.includes("#") ? 0 : 1);
  };
  const excerpt = (text, word) => {
    const at = Math.max(0, text.toLowerCase().indexOf(word) - 60);
    return (at ? "... " : "") + text.slice(at, at + 180);
  };
  function search() {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    found.replaceChildren();
    found.hidden = !words.length || typeof searchIndex === "undefined";
    if (found.hidden) return;
    const hits = searchIndex.map(each => [worth(each, words), each]).filter(each => each[0] > 0).sort((a, b) => b[0] - a[0]).slice(0, 30);
    for (const [, [address, title, text]] of hits) {
      const link = document.createElement("a"), more = document.createElement("small");
      link.href = root + "/" + address;
      link.textContent = title;
      more.textContent = address.replace(/\.html.*/, "") + ": " + excerpt(text, words[0]);
      link.append(more);
      found.append(link);
    }
    if (!hits.length) found.textContent = "No page holds all of these words.";
  }
  input.addEventListener("focus", load);
  input.addEventListener("input", () => { load(); search(); });
  input.form.addEventListener("submit", event => {
    event.preventDefault();
    const first = found.querySelector("a");
    if (first) location.href = first.href;
  });
  found.addEventListener("click", event => { if (event.target.closest("a")) found.hidden = true; });
  document.addEventListener("keydown", event => {
    if (event.key === "/" && !/INPUT|TEXTAREA/.test(document.activeElement.tagName)) { event.preventDefault(); input.focus(); }
    if (event.key === "Escape") { found.hidden = true; input.blur(); }
  });
})();
