"""The quilt, with everything that a decoder needs: charts, placements, warp fields, and painting.

- `model`: the quilt and its texels; `chart`: a grid over a part of a surface
- `placement`, `labels`: what shows where
- `warp_field`: the 2×2 matrices over a chart; `displacement`: where its places read in the exemplar
- `painting`, `normal_painting`, `materials`: from quilt and exemplar to texels; `pyramid`: coarser exemplars
"""
