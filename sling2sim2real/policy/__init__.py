"""The slingshot policies: environment, training, check, export."""
