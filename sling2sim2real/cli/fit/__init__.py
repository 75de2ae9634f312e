"""`sling fit`: a band from its recordings to its card, by the stages of dvc.yaml."""
