"""The target on the floor."""

# y of the paper's fixed target of 1 m by 1 m [m]: a landing outside is a failure, so trials aim
# inside.
TARGET_AREA = (1.425, 2.425)
