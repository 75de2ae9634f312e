# Run a stage: sh stages/run.sh NAME ARGUMENTS...
#
# By the active Python, or else that of .venv: whichever has the packages. DVC has removed the
# stage's output before it calls us, so nothing may fail that need not.
for python in python .venv/bin/python python3; do
    if why=$("$python" -c 'import importlib.util as u, sys
lacks = [n for n in ("numpy", "ruamel.yaml", "warp", "rosbags") if not u.find_spec(n)]
sys.exit(f"{sys.executable} has no {lacks[0]}" if lacks else 0)' 2>&1); then
        if [ -n "$SLING_DASK" ]; then # of `sling flow --dask`: on a worker, in this folder
            exec "$python" -m pipeline.flow.cluster "$@"
        fi
        name=$1
        shift
        exec "$python" -m "stages.$name" "$@"
    fi
    whys="$whys${whys:+; }$why"
done
echo "error: no Python here has this project's packages ($whys): make setup, then source" \
    ".venv/bin/activate; \`dvc checkout\` brings outputs back that DVC has removed" >&2
exit 1
