"""Loads a camera's EXR file into Blender's compositor and checks that it finds every layer.

Needs Blender as a Python module (PyPI's bpy), or runs in `blender --background --python`; `make check-blender` does either.
Exit code 1 if a layer is missing.
"""

import sys

import bpy

# Names under which Blender shows the layers: a root Y is a pass of its own name, a root Z is depth.
PASSES = {"direct", "indirect", "stderr", "luminance", "albedo", "N", "P", "Depth", "Combined"}

file = sys.argv[-1]
image = bpy.data.images.load(file)
if hasattr(bpy.data.scenes[0], "compositing_node_group"):
    tree = bpy.data.node_groups.new("layers", "CompositorNodeTree")
else:
    bpy.data.scenes[0].use_nodes = True
    tree = bpy.data.scenes[0].node_tree
node = tree.nodes.new("CompositorNodeImage")
node.image = image
found = {output.name for output in node.outputs if output.enabled}
print(f"Blender {bpy.app.version_string}: {image.type.lower()}, {', '.join(sorted(found))}")
missing = PASSES - found
if missing or image.type != "MULTILAYER":
    print(f"missing: {', '.join(sorted(missing)) or 'layers at all'}")
    sys.exit(1)
