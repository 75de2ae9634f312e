# Run a stage: sh stages/run.sh NAME ARGUMENTS...
#
# By the active Python, or else that of .venv: whichever has the packages. DVC has removed the
# stage's output before it calls us, so nothing may fail that need not.
for python in python .venv/bin/python python3; do
    if "$python" -c 'import importlib.util as u, sys
sys.exit(not all(map(u.find_spec, ("numpy", "ruamel.yaml", "warp", "rosbags"))))' 2>/dev/null; then
        name=$1
        shift
        exec "$python" -m "stages.$name" "$@"
    fi
done
echo "error: no Python here has this project's packages: make setup, then source" \
    ".venv/bin/activate; \`dvc checkout\` brings outputs back that DVC has removed" >&2
exit 1
