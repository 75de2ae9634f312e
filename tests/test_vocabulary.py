"""The words that names and prose do not use."""

from tools.vocabulary import docstrings, main, names, phrases, variables


def test_the_project_keeps_to_its_words(capsys) -> None:
    assert main() == 0, capsys.readouterr().out


def test_a_word_is_found_where_it_is_a_name_and_a_phrase_where_it_is_prose() -> None:
    code = 'told = row.said  # told\nprint("asked")\n'
    assert list(names(code)) == [(1, "told"), (1, "said")]
    wrong = "hangs " + "on"  # in two parts: this file is searched too
    text = f"It depends on it.\nThe weight {wrong} its bands; the force {wrong} the draw.\n"
    assert [(line, words) for line, words, _ in phrases(text)] == [(2, wrong)]


def test_a_vague_word_is_found_where_it_is_a_variable_or_a_parameter() -> None:
    code = "class A:\n    own: int\ndef f(found):\n    return [one for one in found.about]\n"
    assert sorted(variables(code)) == [(3, "found"), (4, "one")]


def test_a_docstring_begins_with_what_is_done_or_what_there_is() -> None:
    code = '"""Of it."""\ndef f():\n    """Return it."""\nclass A:\n    """As f."""\n    x = "Of"\n'
    assert list(docstrings(code)) == [(1, "Of"), (4, "As")]
