// The editor's view of a text: colors, keys, and what it does while one types.

import { buzz, completing } from "./buzz.js";
import { statementMarks } from "./statement.js";
import { texts } from "./texts.js";
import {
    autocompletion, bracketMatching, closeBrackets, closeBracketsKeymap, completionKeymap, defaultKeymap, drawSelection, EditorState,
    EditorView, foldGutter, foldKeymap, highlightActiveLine, highlightSelectionMatches, highlightSpecialChars, HighlightStyle, history,
    historyKeymap, indentOnInput, indentUnit, keymap, lineNumbers, lintGutter, lintKeymap, searchKeymap, syntaxHighlighting, tags,
} from "./vendor.js";

const colors = HighlightStyle.define([
    { tag: tags.keyword, color: "var(--accent)", fontWeight: "600" }, { tag: tags.comment, color: "var(--soft)", fontStyle: "italic" },
    { tag: tags.string, color: "var(--held)" }, { tag: [tags.number, tags.atom], color: "var(--number)" },
    { tag: tags.function(tags.variableName), color: "var(--accent)" },
]);

const theme = EditorView.theme({
    "&": { height: "100%", fontSize: ".85rem", backgroundColor: "var(--panel)", color: "var(--text)" },
    ".cm-scroller": { fontFamily: "ui-monospace, \"Cascadia Mono\", \"DejaVu Sans Mono\", monospace", lineHeight: "1.5" },
    ".cm-content": { caretColor: "var(--text)" },
    "&.cm-focused": { outline: "3px solid var(--mark)", outlineOffset: "-3px" },
    ".cm-cursor": { borderLeftColor: "var(--text)" },
    ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--soft)", borderRight: "1px solid var(--line)" },
    ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "var(--hover)" },
    "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "var(--chosen)" },
    "&.cm-focused .cm-matchingBracket": { backgroundColor: "var(--chosen)" },
    ".cm-tooltip, .cm-panels": { backgroundColor: "var(--panel)", color: "var(--text)", border: "1px solid var(--line)" },
    ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--panel)" },
    ".cm-completionInfo": { maxWidth: "22rem" },
    ".cm-breakpoints": { width: ".9rem" }, ".cm-breakpoints, .cm-breakpoints + .cm-lineNumbers": { cursor: "pointer" },
    ".cm-breakpoint": { width: ".65rem", height: ".65rem", margin: ".3rem auto 0", border: "1px solid var(--faulted)", borderRadius: "50%", backgroundColor: "var(--faulted)" },
    ".cm-statement": { backgroundColor: "var(--chosen)", boxShadow: "inset 3px 0 var(--mark)" },
    ".cm-values": { marginLeft: "1.5rem", padding: "0 .35rem", borderRadius: ".2rem", backgroundColor: "var(--panel)", color: "var(--mark-text)" },
    ".cm-button, .cm-textfield": { backgroundImage: "none", backgroundColor: "var(--panel)", color: "var(--text)", borderColor: "var(--line)" },
});

/** @import { Word } from "./events" */

/**
 * The acts of the editor that keys and changes of a text call.
 * @typedef {{
 *   run: () => void, load: () => void, write: () => void, typed: () => void, toggleMark: () => boolean, moveMarks: () => void,
 *   words: () => Word[],
 * }} TextActs
 */

// The state of a text that is shown for the first time.
/**
 * @param {string} doc
 * @param {boolean} isScenario
 * @param {TextActs} acts
 */
export function stateOf(doc, isScenario, acts) {
    // A key that has an act does nothing else.
    const does = (/** @type {() => void} */ act) => () => {
        act();
        return true;
    };
    return EditorState.create({
        doc,
        extensions: [
            isScenario ? lineNumbers() : statementMarks(acts.moveMarks), foldGutter(), history(), drawSelection(), indentOnInput(), bracketMatching(), closeBrackets(), highlightActiveLine(),
            // Controls that turn the direction of text could show another script than the one that runs.
            highlightSpecialChars({ addSpecialChars: /[\u202a-\u202e\u2066-\u2069]/g }),
            highlightSelectionMatches(), lintGutter(), theme, syntaxHighlighting(colors), indentUnit.of("    "),
            // A scenario has no names, but the extension: it looks for its state some time after a key, when another text may be shown.
            ...(isScenario ? [] : [buzz, keymap.of([{ key: "F9", run: acts.toggleMark }])]), autocompletion({ override: isScenario ? [] : [completing(acts.words)] }),
            keymap.of([
                { key: "Mod-Enter", run: does(acts.run), shift: does(acts.load) }, { key: "Mod-s", run: does(acts.write) }, ...closeBracketsKeymap, ...defaultKeymap, ...searchKeymap,
                ...historyKeymap, ...foldKeymap,
                ...completionKeymap, ...lintKeymap,
            ]),
            // axe-core does not know that an element in which one writes has the focus.
            EditorView.contentAttributes.of({ "aria-label": texts.scriptText, tabindex: "0" }),
            EditorView.updateListener.of(({ docChanged }) => docChanged && acts.typed()),
        ],
    });
}
