// All texts of the page, in French.

/**
 * @import { english } from "./texts-en.js"
 */

// Four digits, without the zeros that end a fraction. The point is that of the scripts.
const numberText = (/** @type {number} */ value) => (Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(4))));

// By the sum of 1 for red, 2 for green and 4 for blue.
const COLORS = ["éteinte", "rouge", "vert", "jaune", "bleu", "magenta", "cyan", "blanc"];
const ledName = (/** @type {number} */ led) => COLORS[led];

/** @type {Record<string, string>} */
const MEDIA = { ir: "Infrarouge", nrf24: "nRF24", p2p: "P2P", rab: "Distance et direction" };

/** @type {typeof english} */
export const french = {
    controls: "exécution", play: "Lecture", pause: "Pause", playHelp: "Lecture ou pause (espace)",
    home: "Au début (Origine)", back: "Un pas en arrière (,)", step: "Un pas en avant (.)",
    rate: "Vitesse", asFast: "aussi vite que possible", rateOf: (rate) => `${rate} ×`,
    save: "Enregistrer en scénario", saveHelp: "Un fichier de scénario avec ses scripts, qui rejoue cette session depuis n'importe quel dossier",
    missing: (names) => `Le scénario enregistré a besoin de ces fichiers à côté de lui, car ce ne sont pas des textes : ${names}`,
    clock: (seconds, end) => `${seconds.toFixed(1)} s sur ${end.toFixed(1)} s`, time: "Temps de l'exécution", marks: "Repères de l'exécution : les flèches mènent de l'un à l'autre",
    markAt: (seconds, text) => `${seconds.toFixed(1)} s : ${text}`,
    over: "L'exécution est terminée.", cut: (reason) => `L'enregistrement s'arrête avant la fin : ${reason}.`,
    away: "La session est terminée. Relancez-la dans le terminal.",
    elsewhere: "Une autre page montre maintenant cette session. Ce que vous faites ici est sans effet.",
    takeOver: "Continuer ici", takeOverHelp: "Cette page reprend la session de l'autre",
    late: (seconds) => `La session n'a pas répondu depuis ${seconds.toFixed(0)} s : elle calcule, ou l'ordinateur est occupé.`,
    broken: "Le terrain de jeu ne démarre pas : ses fichiers ne peuvent pas être chargés. Rechargez la page.",
    moduleDefect: (version, reason) => `défaut de bbz ${version} : ${reason}`,
    moduleAdvice: "vos fichiers ne sont pas en cause ; votre texte est encore dans l'éditeur : téléchargez-le, signalez cette ligne avec vos étapes, puis rechargez la page",
    failed: (text) => `L'exécution ne peut pas continuer : ${text}`,
    unknownEvent: (name) => `La page ne connaît pas l'événement « ${name} » de la session : c'est un défaut de bbz.`,
    closeNotice: "Fermer ce message (Échap)",
    example: "Exemple",

    keys: "Touches et langue", close: "Fermer",
    language: "Langue", ofEnglish: "Les messages du compilateur, les scénarios et le livre sont en anglais.",
    allKeys: [
        ["Espace", "lecture ou pause"], [",  .", "un pas en arrière, un pas en avant"], ["Origine", "au début"],
        ["Tab", "d'une partie de la page à la suivante"],
        ["n  p", "dans le monde : le robot suivant, le précédent"], ["f", "dans le monde : suivre le robot choisi, ou ne plus le suivre"], ["Échap", "dans le monde : aucun robot"],
        ["Maj + clic", "sur un robot : compare sa courbe avec d'autres"], ["c", "dans le monde : compare le robot choisi, ou ne le compare plus"],
        ["Maj + flèches", "dans le monde : déplace le robot choisi de 10 mm"],
        ["Ctrl + flèches", "dans le monde en 3-D : le tourner et l'incliner"],
        ["Ctrl + Entrée", "dans le script : exécuter depuis le début avec ce texte"], ["Ctrl + S", "dans le script : l'enregistrer"],
        ["Maj + Ctrl + Entrée", "dans le script : charger le texte maintenant, pendant l'exécution"],
        ["Flèches  +  −  0  r", "dans le monde : déplacer la vue, zoomer, tout montrer, montrer les robots"],
    ],

    canvas: "Le monde, vu d'en haut. Touches : point d'interrogation",
    hint: "Cliquez sur un robot pour voir son état. Faites glisser les robots, les lampes ou le sol ; zoomez avec la molette.",
    hintWatched: "Robots qui envoient des rapports. Leur position n'est pas connue.", noMore: "La trace est terminée.", seconds: (seconds) => `${seconds.toFixed(1)} s`,
    wind: (speed) => `vent ${speed} mm/s`,
    display: "comment le monde est montré", color: "Couleur selon", byState: "état", messages: "Messages", trails: "Traces",
    stopOnError: "Arrêt sur erreur", stopOnErrorHelp: "L'exécution se met en pause quand un script a une erreur, et l'éditeur montre l'endroit",
    tilt: "3-D", tiltHelp: "Vu de côté. Tournez avec le bouton droit de la souris, ou Ctrl + flèches",
    picture: "Image", pictureHelp: "Enregistre la vue dans un fichier PNG", pictureAs: "bittybuzz.png",
    drawing: "Dessin", drawingHelp: "Enregistre le monde dans un fichier SVG", drawingAs: "bittybuzz.svg",
    quantities: { plot: "du scénario", robot: "chaque robot", swarm: "l'essaim", global: "variables globales" },
    addCurve: "Courbe …", addCurveLabel: "ajouter la courbe d'une grandeur",
    curveLabel: (name) => `${name} au cours du temps`,
    curve: (time, five, isSingle) => {
        const [a, b, c, d, e] = five.map((value) => (Number.isFinite(value) ? numberText(value) : "aucune"));
        return isSingle || c === "aucune" ? `à ${time} : ${c}` : `à ${time} : médiane ${c}, la moitié de ${b} à ${d}, tous de ${a} à ${e}`;
    },
    inUnit: (name, unit) => `${name} en ${unit}`,
    noPoint: (time) => `à ${time} : inconnu`,
    scales: { all: "toutes les valeurs", clipped: "coupée", log: "logarithmique" },
    scaleOf: (name) => `échelle de ${name}`,
    above: (value) => `↑ jusqu'à ${numberText(value)}`, below: (value) => `↓ jusqu'à ${numberText(value)}`,
    timeTick: (seconds) => `${numberText(seconds)} s`,
    nothingPositive: "Une échelle logarithmique ne montre que les nombres supérieurs à 0.", noNumbers: "Aucun robot n'a de nombre ici.",
    csv: "CSV", saveCurve: (name) => `Enregistrer ${name} en CSV`, saveCurveHelp: "Enregistre les points en tableau (CSV)",
    closeCurve: (name) => `Fermer la courbe de ${name}`,
    curveColumns: { time: "temps en s", value: "valeur", five: ["min", "premier quartile", "médiane", "troisième quartile", "max"] },
    curveAs: (name) => `${name.replaceAll(/[^\w.-]+/g, "_").replace(/_$/, "")}.csv`,
    computingPast: (percent) => `Le passé des courbes est en calcul : ${percent} %.`,
    pastStopped: (percent) => `Le passé des courbes est connu à ${percent} %.`,
    pastUnknown: (reason) => `Le passé des courbes n'est pas connu : ${reason}.`,
    stopCurves: "Arrêter", stopCurvesHelp: "Ne calcule plus le passé", goOnCurves: "Continuer", goOnCurvesHelp: "Calcule le reste du passé",
    curveOf: (id, value) => `robot ${id} : ${numberText(value)}`,
    number: numberText,
    labels: "Étiquettes", labelsHelp: "Les numéros des robots, et des lettres pour les couleurs de leurs LED, là où il y a de la place",
    follow: "Suivre", followHelp: "Garde le robot choisi au milieu (f)",
    fitRobots: "Cadrer les robots", fitRobotsHelp: "Montre tous les robots aussi grands que possible (r)",
    tabAbout: "Sujet",
    colorsOf: (script) => `Couleurs de ${script}`, scriptOf: (script) => `Script ${script}`,
    colors: COLORS, colorLetters: ["", "R", "V", "J", "B", "M", "C", "W"],
    lights: "Lampes", lightAt: (x, y, brightness) => `Lampe en (${x}, ${y}) mm, luminosité ${brightness}`,
    tries: "À essayer",
    countOf: (count, robot) => (robot ? `${count} × ${robot}` : `${count} ${count === 1 ? "robot" : "robots"}`),
    idsOf: (first, last) => (first === last ? `numéro ${first}` : `numéros ${first} à ${last}`),
    runs: (script) => `script ${script}`,
    rangeOf: ({ medium, range, is_between_rims: isBetweenRims }) => {
        const name = MEDIA[medium] ?? medium;
        return range === null ? `${name} sans limite de portée` : `${name} jusqu'à ${numberText(range)} mm${isBetweenRims ? " d'un bord à l'autre" : ""}`;
    },
    led: "LED", range: "Portée", attitude: "Attitude",
    ledOf: (color, meaning) => (meaning ? `${COLORS[color]} : ${meaning}` : COLORS[color]),
    attitudeOf: ({ roll, pitch, thrust }) => `roulis ${Math.round(roll)}°, tangage ${Math.round(pitch)}°, poussée ${Math.round(thrust)} %`,
    tabRobot: "Robot", tabTable: "Liste", tabScript: "Script", tabLog: "Journal", tabTests: "Tests", tabGround: "Monde",

    allRobots: "Tous les robots : les flèches en choisissent un, Entrée en dit plus", robotsHead: ["N°", "État", "x", "y", "z", "LED"],
    noRobotNow: "Aucun robot n'est choisi.",
    announced: (id, state, seen) => `Robot ${id}, ${[state, ...seen].join(", ")}`,
    pausedAt: (clock) => `En pause à ${clock}`,
    noRobot: "Aucun robot n'est choisi. Cliquez sur l'un d'eux.",
    robot: (id) => `Robot ${id}`,
    state: "État", states: ["actif", "arrêté", "en panne", "arrêté par une erreur"],
    group: "Groupe", script: "Script", place: "Position", memory: "Mémoire",
    placeOf: (x, y, z, degrees) => `(${x.toFixed(1)}, ${y.toFixed(1)}${z ? `, ${z.toFixed(1)}` : ""}) mm, ${Math.round(degrees) % 360}°`,
    ledName, ledIs: (led) => `LED ${ledName(led)}`,
    radius: "Rayon", radiusOf: (mm) => `${mm} mm`,
    estimate: "Estimation",
    estimateOf: (x, y, z, away) => `${Math.round(x)}, ${Math.round(y)}, ${Math.round(z)} mm (à ${Math.round(away)} mm)`,
    battery: "Batterie",
    batteryOf: (millivolts, charge) => `${(millivolts / 1000).toFixed(2)} V${charge === null ? "" : `, reste ${Math.round(charge * 100)} %`}`,
    memoryOf: (used, all) => `${used} cases sur ${all}`,
    fail: "Panne", failHelp: "Ni moteur, ni message, ni pas jusqu'au redémarrage",
    stop: "Arrêter", stopHelp: "Ni moteur, ni message, ni pas jusqu'à la reprise",
    resume: "Reprendre", resumeHelp: "Un robot arrêté continue là où il était",
    restart: "Redémarrer", restartHelp: "Éteint et rallumé : le script recommence",
    compare: "Comparer", compareHelp: "Montre sa courbe à côté de celles d'autres robots : six au plus", comparedMax: "Six robots sont déjà comparés : retirez-en un.",
    block: "Isoler", blockHelp: "Aucun message ne lui arrive ni n'en part",
    restore: "Reconnecter", restoreHelp: "Ses liens coupés fonctionnent à nouveau",
    x: "x en mm", y: "y en mm", move: "Déplacer", moveHelp: "Place le robot ici",
    faultAt: (code, seconds) => `Erreur ${code} à ${seconds.toFixed(1)} s : `,
    faultPlace: ({ file, line, function: of }) => `${file}:${line}${of ? `, dans ${of}` : ""}`,
    robotAt: (id, seconds) => `Robot ${id} à ${seconds.toFixed(1)} s`,
    stoppedBy: (id, isContained, others) => `${isContained ? `Une fonction d'écoute du robot ${id} s'est terminée` : `Le robot ${id} s'est arrêté`} par une erreur`
        + `${others > 0 ? ` ; ${others} autres aussi au même pas` : ""}.`,
    memoryAtFault: (seconds) => `Mémoire au moment de l'erreur, à ${seconds.toFixed(1)} s`,
    is: " vaut ", calledAt: "appelée en ", unknownPlace: "un endroit inconnu", moreCalls: (count) => `${count} appels de plus`,
    hideFault: "Masque l'erreur",

    globals: "Variables globales", frame: "Dans", neighbors: "Voisins", swarms: "Essaims", stigmergy: "Stigmergie",
    queues: "Messages", inbox: "à lire", outbox: "à envoyer", none: "aucun",
    noMemory: "Sa mémoire est dans un émulateur, ou il n'est pas encore arrivé.",
    neighbor: ({ distance, azimuth }) => {
        const degrees = azimuth ? `, ${((azimuth * 180) / Math.PI).toFixed(0)}°` : "";
        return distance === null ? "entendu, sans position" : `à ${distance.toFixed(0)} mm${degrees}`;
    },
    swarm: (isMember) => (isMember ? "membre" : "non membre"),
    entry: (owner, clock) => `du robot ${owner}, horloge ${clock}`,
    waiting: (count, capacity) => `${count} sur ${capacity}`,
    message: (one) => ("robot" in one ? `${one.kind} de ${one.robot}` : one.kind),
    table: (count) => (count === 1 ? "1 entrée" : `${count} entrées`),
    leftOut: (count) => `… ${count} de plus`,

    scriptText: "texte du script", diagnostics: "messages du compilateur", help: "aide",
    controlsOfScripts: "réglages des scripts",
    keep: "garder les nombres", keepHelp: "Les variables globales qui contiennent des nombres les gardent, là où le nouveau texte en a aussi",
    run: "Exécuter", runHelp: "Recommence l'exécution avec les textes de cet éditeur (Ctrl + Entrée)", began: "L'exécution a recommencé depuis le début.",
    keepChanges: "garder mes changements", keepChangesHelp: "Exécuter : ce que vous avez changé dans le monde se reproduit, aux mêmes instants",
    load: "Charger maintenant", loadHelp: "Les robots reçoivent ce texte comme script maintenant, pendant l'exécution (Maj + Ctrl + Entrée)",
    loadOptions: "Charger maintenant :", ran: (name) => `Les robots exécutent ${name}.`,
    runOn: "robots qui l'exécutent", runOnAll: "sur tous ceux qui l'ont", runOnOne: (id) => `sur le robot ${id}`,
    write: "Enregistrer", writeHelp: "Écrit le texte dans son fichier (Ctrl + S)", written: (name) => `${name} est enregistré.`,
    download: "Télécharger", downloadHelp: "Enregistre le texte dans un fichier (Ctrl + S)",
    changedOnDisk: (name) => `${name} a sur le disque un autre texte que celui lu par cette page.`,
    goneOnDisk: (name) => `${name} ne peut plus être lu.`,
    overwrite: "Remplacer", overwriteHelp: "Écrit votre texte dans le fichier",
    loadOther: "Charger", loadOtherHelp: "Montre l'autre texte. Annuler ramène le vôtre (Ctrl + Z)",
    otherText: (name) => `La session a un autre texte de ${name}.`,
    unsavedTexts: "textes non enregistrés",
    unsaved: (name, time) => `${name}, tapé le ${time.toLocaleString("fr-FR", { dateStyle: "medium", timeStyle: "short" })} et non enregistré`,
    unsavedOfOther: "Le fichier a changé depuis.",
    restoreText: "Rétablir", restoreTextHelp: "Montre ce texte dans l'éditeur. Annuler ramène l'autre (Ctrl + Z)",
    discard: "Supprimer", discardHelp: "Efface ce texte",
    unsavedMark: "Script •",
    link: "Lien", linkHelp: "Une adresse de cette page qui contient le texte",
    linked: "L'adresse de cette page contient maintenant le texte.", linkedAndCopied: "L'adresse de cette page contient maintenant le texte, et se trouve dans le presse-papiers.",
    offered: "Le script de l'adresse ne s'exécute pas ici : corrigez-le.",
    noStorage: (reason) => `Le navigateur ne garde pas les textes non enregistrés : ${reason}`,
    badAddress: "l'adresse contient un script qui ne peut pas être lu",
    longAddress: (path) => `l'adresse contient plus de texte que permis : ${path} dépasse 1 Mio, ou tous les scripts 4 Mio`,
    exportPage: "Exporter", exportHelp: "Cette page avec le scénario et les scripts en un seul fichier, qui fonctionne sans réseau", exportedAs: "bittybuzz.html",
    explain: "Expliquer", explainHelp: "Explique le message", goThere: "Vers cet endroit", fix: "Corriger", fixHelp: "Change le texte comme le dit le message",
    line: (line) => `ligne ${line}`,

    seeking: (seconds, left) => `En route vers ${seconds.toFixed(1)} s : encore ${left.toFixed(left < 10 ? 1 : 0)} s environ.`,
    pausing: "Le simulateur termine ce pas du monde.",
    lostLines: (count) => `${count.toLocaleString("fr-FR")} lignes précédentes sont arrivées trop vite pour être montrées.`,
    noLog: "Rien dans le journal pour l'instant.", noTests: "Le scénario n'attend rien.",
    verdicts: { open: "ouvert", held: "tenu", failed: "échoué" },
    ofOlder: "d'un texte plus ancien",
    older: {
        edited: "Ces voyants sont ceux d'un texte plus ancien : le texte de l'éditeur n'a pas encore été exécuté. Pressez Exécuter dans Script.",
        loaded: "Ces voyants sont en partie ceux d'un texte plus ancien : un texte a été chargé pendant l'exécution. Pressez Exécuter dans Script, qui recommence depuis le début.",
    },

    handIn: "Rendre", handInHelp: "Exécute les textes depuis le début, sans vos changements du monde, et enregistre un fichier avec eux et le résultat",
    trying: "Les scripts sont essayés …", by: "Votre nom",
    handedIn: ({ name, held, count, success }) => {
        const verdict = `${held} sur ${count} tenues`;
        if (success) {
            return `${verdict}. ${name} est enregistré : rendez-le.`;
        }
        return held === count
            ? `${verdict}, mais un script a eu une erreur (voir Journal) : le devoir n'est pas encore résolu. ${name} est tout de même enregistré.`
            : `${verdict} : le devoir n'est pas encore résolu. ${name} est tout de même enregistré.`;
    },
    grade: "Noter les devoirs", gradeHelp: "Exécute de nouveau dans ce scénario les fichiers rendus (*.json). On peut aussi les déposer sur la page. Rien ne quitte cet ordinateur.",
    grading: "Les devoirs s'exécutent …", tooLarge: (name) => `${name} dépasse 16 Mo : ce n'est pas un devoir`, marksAs: "notes.csv", saveMarks: "Enregistrer en tableau", notRun: "ne s'exécute pas",
    marksHead: ["Devoir", "Tenues", "Remarques"], heldOf: (held, count) => `${held} sur ${count}`,
    sameAs: (files) => `les mêmes scripts que ${files}`, scriptError: "un script a eu une erreur",
    tryOut: "Essais multiples", sweepHelp: "Le scénario depuis son début, à côté de cette exécution : avec les derniers scripts exécutés, et sans vos changements",
    vary: "Varier", varyNothing: "le hasard seul", varyExample: "medium.ir.loss", values: "Valeurs", valuesExample: "0, 0.1, 0.3",
    seeds: "Graines pour chacune", measure: "Montrer", start: "Démarrer", stopTrials: "Arrêter", since: "vrai depuis, en s", expectation: "attentes",
    percentDone: (percent) => `${percent} %`, saveTable: "Enregistrer en tableau", tableAs: "essais.csv",
    sweepLabel: "la mesure, pour chaque valeur", chance: "hasard",
    sweepHead: ["Valeur", "Essais", "Réussis", "Médiane", "La moitié"], quartiles: (low, high) => `${numberText(low)} à ${numberText(high)}`,

    size: "Taille", sizeOf: (width, height) => `${width} × ${height} mm`, robots: "Robots", seed: "Graine",
    runSeedHelp: "Recommence l'exécution avec cette graine, qui est alors écrite dans le texte du scénario",
    noWorld: "Le scénario n'a pas de section [world] : écrivez la graine dans son texte.",
    losses: "Messages perdus", media: MEDIA,
    lossOf: (name) => `part des messages par ${name} qui se perdent`,
    percent: (share) => `${Math.round(100 * share)} %`, ofModel: "du modèle",
    partition: "Partition", partLabel: "robots qui n'entendent que leur partie : numéros, intervalles ou groupes", partExample: "3, 5..8",
    drawLine: "Tracer une ligne", drawLineHelp: "Tirez une ligne à travers le monde : les robots d'un côté n'entendent pas ceux de l'autre",
    cutOff: "Couper", cutOffHelp: "Ces robots et tous les autres ne s'entendent pas",
    heal: "Réunir", healHelp: "Tous s'entendent à nouveau",
    fence: (group) => `Enclos de ${group}`, height: "Hauteur",
    between: (least, most) => `${least ?? "sans limite"} à ${most ?? "sans limite"}${least === null && most === null ? "" : " mm"}`,
    surroundings: (group) => `Environnement de ${group}`, poses: "Positions fausses venues de l'extérieur",
    poseError: (id, x, y, other) =>
        `robot ${id} : ${[...(other === null ? [] : [`celles du robot ${other}`]), ...(x === 0 && y === 0 ? [] : [`décalées de ${x}, ${y} mm`])].join(", ")}`,
    lamps: "Lampes", lamp: (number) => `Lampe ${number}`, brightness: "lumineuse",
    lampX: (number) => `lampe ${number} : x en mm`, lampY: (number) => `lampe ${number} : y en mm`,
    lampBrightness: (number) => `lampe ${number} : luminosité, 0 à 1023`,
    commands: "Vos changements",
    undo: "Annuler", undoHelp: "L'exécution telle qu'avant votre dernier changement", redo: "Rétablir", redoHelp: "De nouveau le changement annulé",
    deleteChange: (text, seconds) => `Supprimer ${text} à ${seconds} s`,
    deleteChangeHelp: "L'exécution comme si ce changement n'avait jamais eu lieu ; les suivants agissent de nouveau",
    eventAt: (seconds) => `événement du scénario à ${seconds} s`,
    digest: "Empreinte", compute: "Calculer",
    digestHelp: "Un nombre qui représente tout l'état : deux exécutions identiques ont le même",
    digestAt: (digest, seconds) => `${digest} à ${seconds.toFixed(1)} s`,
    savedAs: "session.toml",
};
