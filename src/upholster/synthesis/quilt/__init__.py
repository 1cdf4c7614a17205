"""Method "quilt": one texture over a complete charted surface, block by block.

- `scene`: the surface as blocks cover it; `method`: the steps; `quilt_options`: their options
- `sizes`: the size of blocks; `centres`: their centres; `block_order`: their distances and ranks
- `lay_plan`: the parameters of laying; `parcels`: large surfaces in parts; `laying`: lays them
- `laid_blocks`: a parcel's blocks; `lay_order`: the order of new ones; `relaying`: the places laid again
- `ground`: the surface on which blocks are laid; `steering`: requests of what blocks show where
- `match_pyramid`, `features`: the values by which blocks are compared; `irregularity`: how badly they fit
- `usable_blocks`: blocks of a masked sample; `phases`: a repeating sample in step
- `puts`: pieces that the user places
- `emit`: the visible parts of blocks as placements and labels
- `kernels`: the kernels of all of these
"""
