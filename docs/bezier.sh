#!/bin/sh
# Draws docs/bezier.png: Bézier volumes beside a level set and a mesh.
# bezier.sh COMMAND [FOLDER]
set -eu
