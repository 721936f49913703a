// Colors for scripts in Buzz. The book's own script has run before this one, and knew no language of that name.
hljs.registerLanguage("buzz", () => ({
    keywords: {
        keyword: "var if else function return for while foreach in and or not include",
        literal: "nil",
        built_in: "neighbors swarm stigmergy math table string log print size assert",
    },
    contains: [hljs.HASH_COMMENT_MODE, hljs.QUOTE_STRING_MODE, hljs.APOS_STRING_MODE, hljs.C_NUMBER_MODE],
}));
for (const block of document.querySelectorAll("code.language-buzz")) hljs.highlightBlock(block);
