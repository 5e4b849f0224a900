// The page's colours, which its style sheet chooses by the reader's light or dark theme.

/** The value of a custom property of the page, such as "--ink". */
export function pageColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Calls back whenever the reader's theme changes. */
export function onThemeChange(callback) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", callback);
}
