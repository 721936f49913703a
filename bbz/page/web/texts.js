// The texts of the page, in the language that the reader chose, or else in that of the browser.

import { english } from "./texts-en.js";
import { french } from "./texts-fr.js";

/** @type {Record<string, typeof english>} */
const LANGUAGES = { en: english, fr: french };

// The languages by the names that they have in themselves.
export const NAMES = [["en", "English"], ["fr", "Français"]];

// The name by which the browser keeps the choice.
const KEPT = "bittybuzz-language";

export const language = [kept(), ...navigator.languages].map((name) => name.slice(0, 2)).find((name) => Object.hasOwn(LANGUAGES, name)) ?? "en";

export const texts = LANGUAGES[language];

// A browser may keep nothing.
function kept() {
    try {
        return localStorage.getItem(KEPT) ?? "";
    } catch {
        return "";
    }
}

// The texts of a file that are in the language of the page, or else those in the language of the file.
/**
 * @template {{ language: string | null }} T
 * @param {T[]} all
 */
export function translated(all) {
    const own = all.filter((one) => one.language === language);
    return own.length > 0 ? own : all.filter((one) => one.language === null);
}

// The page in another language, from the next time on that it is loaded.
/** @param {string} name */
export function keepLanguage(name) {
    try {
        localStorage.setItem(KEPT, name);
    } catch {
        // It stays in the language of the browser.
    }
}
