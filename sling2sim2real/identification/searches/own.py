"""A search of the user's lies elsewhere: after a change of it `dvc repro --force` runs it again."""
