// The theme switch, the menu of narrow windows, and the search.
"use strict";

const root = document.documentElement.dataset.root;
const panel = document.querySelector(".results");
const field = document.querySelector(".search input");

// Theme: the system's, or the other one.
const dark = matchMedia("(prefers-color-scheme: dark)");
const button = document.querySelector(".theme");
function isDark() {
  const theme = document.documentElement.dataset.theme;
  return theme ? theme === "dark" : dark.matches;
}
function nameTheme() {
  button.setAttribute("aria-label", isDark() ? "Use the light theme" : "Use the dark theme");
  button.title = button.getAttribute("aria-label");
}
button.addEventListener("click", () => {
  const theme = isDark() ? "light" : "dark";
  const isSystems = (theme === "dark") === dark.matches;
  if (isSystems) delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  try {
    if (isSystems) localStorage.removeItem("tfcompose-theme");
    else localStorage.setItem("tfcompose-theme", theme);
  } catch {
    // Storage is off: the choice is for this page.
  }
  nameTheme();
});
dark.addEventListener("change", nameTheme);
nameTheme();

// Menu of narrow windows.
const menu = document.querySelector(".menu");
menu?.addEventListener("click", () => {
  const isOpen = document.querySelector(".pages").classList.toggle("open");
  menu.setAttribute("aria-expanded", isOpen);
});
document.querySelector(".pages [aria-current]")?.scrollIntoView({ block: "nearest" });

// Search: the index is a script, since a page opened as a file may not fetch one. It is loaded
// when the field is first used, and defines searchIndex: rows of kind, title, address, text.
let index;
function loadIndex() {
  if (index) return;
  index = [];
  const script = document.createElement("script");
  script.src = `${root}search-index.js`;
  script.onload = () => {
    index = searchIndex.map(([kind, title, address, text]) => ({
      kind, title, address, text, lowerTitle: title.toLowerCase(), lowerText: text.toLowerCase(),
      words: title.toLowerCase().split(/[^a-z0-9_]+/),
    }));
    search();
  };
  document.head.append(script);
}

const MOST_RESULTS = 30;
function search() {
  const query = field.value.trim().toLowerCase();
  const terms = query.split(/\s+/).filter(Boolean);
  panel.hidden = terms.length === 0;
  if (panel.hidden) return;
  const results = index
    .map((entry) => ({ entry, score: scoreOf(entry, query, terms) }))
    .filter(({ score }) => score > 0)
    .sort((a, b) => b.score - a.score)
    .slice(0, MOST_RESULTS);
  panel.replaceChildren(...results.map(({ entry }) => linkTo(entry, terms)));
  if (results.length === 0) panel.append(element("p", `Nothing found for “${field.value.trim()}”.`));
  select(0);
}

// Every term must occur. The title counts more than the text, and of that a whole word more than
// the begin of one. Of equals commands and topics come first.
const WEIGHTS = { command: 40, topic: 30, code: 20, keys: 20, key: 10, option: 0 };
function scoreOf(entry, query, terms) {
  let score = (entry.lowerTitle === query ? 1000 : 0) + WEIGHTS[entry.kind];
  for (const term of terms) {
    if (entry.words.includes(term)) score += 150;
    else if (entry.words.some((word) => word.startsWith(term))) score += 100;
    else if (entry.lowerTitle.includes(term)) score += 50;
    else if (entry.lowerText.includes(term)) score += 5;
    else return 0;
    score += (20 * term.length) / entry.title.length;
  }
  return score;
}

function element(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

function linkTo(entry, terms) {
  const link = document.createElement("a");
  link.href = root + entry.address;
  link.setAttribute("role", "option");
  link.append(element("span", entry.kind), element("b", entry.title), excerpt(entry, terms));
  return link;
}

const EXCERPT = 130;
function excerpt(entry, terms) {
  const first = Math.min(...terms.map((term) => entry.lowerText.indexOf(term)).filter((at) => at >= 0), entry.text.length);
  const begin = first === entry.text.length || first < EXCERPT / 2 ? 0 : entry.text.lastIndexOf(" ", first - 40) + 1;
  const text = entry.text.slice(begin, begin + EXCERPT);
  const small = element("small", begin > 0 ? "…" : "");
  const pattern = new RegExp(`(${terms.map((term) => term.replace(/[^a-z0-9]/g, "\\$&")).join("|")})`, "i");
  for (const [number, piece] of text.split(pattern).entries()) {
    small.append(number % 2 ? element("mark", piece) : piece);
  }
  if (begin + EXCERPT < entry.text.length) small.append("…");
  return small;
}

function select(number) {
  const links = [...panel.querySelectorAll("a")];
  links.forEach((link, at) => link.setAttribute("aria-selected", at === number));
  links[number]?.scrollIntoView({ block: "nearest" });
}
function move(by) {
  const links = [...panel.querySelectorAll("a")];
  const now = links.findIndex((link) => link.getAttribute("aria-selected") === "true");
  if (links.length) select((now + by + links.length) % links.length);
}

field.addEventListener("focus", loadIndex);
field.addEventListener("input", () => { loadIndex(); search(); });
field.addEventListener("keydown", (event) => {
  if (event.key === "ArrowDown") move(1);
  else if (event.key === "ArrowUp") move(-1);
  else if (event.key === "Enter") panel.querySelector("[aria-selected='true']")?.click();
  else if (event.key === "Escape") { panel.hidden = true; field.blur(); }
  else return;
  event.preventDefault();
});
document.addEventListener("keydown", (event) => {
  const isTyping = event.target.closest?.("input, textarea, select");
  if (event.key === "/" && !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey) {
    event.preventDefault();
    field.focus();
  }
});
document.addEventListener("click", (event) => {
  if (!event.target.closest(".search") || event.target.closest(".results a")) panel.hidden = true;
});
field.closest(".search").hidden = button.hidden = false;
