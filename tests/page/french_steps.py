"""The sentences of lessons in French that ask for something in the page, and the names of the acts of `Learner` (test_lessons.py)."""

FRENCH_STEPS = [
    (r"Pressez \*Lecture\* : [^*]+", "plays"),
    (r"\*Tests\* montre les attentes, et lesquelles échouent\.", "sees_the_tests"),
    (r"\*Traces\* montre son chemin\.", "sees_trails"),
    (r"Écrivez votre réponse dans \*Script\*, et pressez \*Exécuter\* ou Ctrl \+ Entrée : l'exécution recommence depuis le début avec votre texte\.", "answers"),
    (r"Quand tous les voyants de \*Tests\* sont verts à la fin de l'exécution, pressez \*Rendre\*\.", "hands_in"),
    (r"Pressez \*Lecture\*, qui recommence à la fin d'une exécution, et faites glisser la lampe avec la souris : les couleurs la suivent\.", "drags_the_lamp"),
    (r"\*Messages\* trace une ligne pour chaque message qui arrive, et une ligne différente pour chaque message qui se perd\.", "sees_messages"),
    (r"Pressez \*Lecture\*, qui recommence à la fin d'une exécution, pour les voir\.", "plays_to_see_them"),
    (r"Cliquez sur un robot : la page montre ses voisins et leurs distances\.", "clicks_on_a_robot"),
    (r"Pressez \*Lecture\*, qui recommence à la fin d'une exécution, cliquez sur d'autres robots, et pressez \*Panne\*\.", "fails_robots"),
]
