// Runs before anything is drawn. Sets the chosen theme; without a choice the system's applies.
document.documentElement.classList.add("js");
try {
  const theme = localStorage.getItem("tfcompose-theme");
  if (theme) document.documentElement.dataset.theme = theme;
} catch {
  // Storage is off: the system's theme applies.
}
