// The pages' scripts: modules for browsers, joined into one by cell/html/page.py.
import js from "@eslint/js";

const BROWSER = [
  "addEventListener", "atob", "Blob", "cancelAnimationFrame", "console", "DecompressionStream", "devicePixelRatio", "document",
  "getComputedStyle", "getSelection", "matchMedia", "navigator", "performance", "requestAnimationFrame", "ResizeObserver", "Response",
  "setTimeout", "clearTimeout", "TextDecoder", "URL", "window",
];

export default [
  js.configs.recommended,
  {
    files: ["**/*.js"],
    languageOptions: {
      ecmaVersion: 2022,
      sourceType: "module",
      globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])),
    },
  },
];
