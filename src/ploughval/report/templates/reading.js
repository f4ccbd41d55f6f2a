// Reading: where one is in the list of chapters, tables that scroll and those that do not, folds in print.
const chapters = document.querySelector("nav.chapters");

// The chapter at the top of the window is marked in the list, and brought into view there.
function mark(link) {
  const current = chapters.querySelector("[aria-current]");
  if (current === link) return;
  current?.removeAttribute("aria-current");
  link.setAttribute("aria-current", "true");
  const list = chapters.firstElementChild, middle = link.offsetLeft - (list.clientWidth - link.offsetWidth) / 2;
  list.scrollTo({ left: middle });
}

if (chapters && "IntersectionObserver" in window) {
  const links = new Map([...chapters.querySelectorAll("a")].map((link) => [link.hash.slice(1), link]));
  const watch = new IntersectionObserver(
    (entries) => { for (const { isIntersecting, target } of entries) if (isIntersecting) mark(links.get(target.id)); },
    { rootMargin: "-12% 0px -80% 0px" },
  );
  for (const key of links.keys()) watch.observe(document.getElementById(key));
}

// Only what scrolls needs a stop for the keyboard.
function stops() {
  for (const part of document.querySelectorAll(".scroll, figure")) {
    if (!part.offsetParent) continue;
    if (part.scrollWidth > part.clientWidth + 1) part.tabIndex = 0;
    else part.removeAttribute("tabindex");
  }
}
stops();
addEventListener("resize", stops);
document.addEventListener("toggle", stops, true);

// Paper cannot be unfolded: what is folded is printed open, and folded again after.
let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open]):not(.long)")];
  for (const fold of opened) fold.open = true;
});
addEventListener("afterprint", () => { for (const fold of opened) fold.open = false; });
