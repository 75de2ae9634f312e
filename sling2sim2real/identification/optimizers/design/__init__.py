"""One design over the whole box."""
