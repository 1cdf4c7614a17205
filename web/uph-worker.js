// Decodes, paints and tessellates a `.uph` stream off the main thread: the module Worker of `uph-three.js`.
//
// In:  open {maxTextureSize, maxTexels, limits, eye, pixels, onPage, sketches}
//                                         once, first; `limits`, optional, all of a decoder's; `eye`, optional, is a vector toward the viewer: near charts are
//                                         painted first;
//                                         the model's radius is `pixels` long at its nearest point: textures get about as
//                                         many texels; without it, all;
//                                         with `onPage` the page paints, if it shows the same; textures have at most
//                                         `sketches` texels at first, as their entries say;
//                                         `whole`: nothing is decoded and shown before everything has arrived, and a sample that
//                                         this worker has decoded is not decoded again
//      feed {bytes}                       further bytes of the stream
//      end {}                             there are no more
//      limit {bytes?, coefficients?}      show only a prefix; neither: all received bytes
//      exemplar {picture}                 paint with it, of the exemplar's size, instead of the exemplar; null: with that again
//      paint {}                           paint in the worker after all
//      counts {counts}                    segments of every chart, along s and along t
//      pixels {perUnit}                   charts are larger on screen now: pixels that a unit of length takes on each
//      shown {buffers}                    the last `textures` are on screen; buffers to use again
//      join {port}                        another stream: the same messages through a port of its own
//      close {}                           the stream is no longer wanted
//      Any may have a `ticket`: states contain the last one that was handled.
// Out: surface {bounds, sphere, plain, metres, exemplar}
//                                         spheres around the charts, and around all of them; triangles on no chart; length of the unit, or null; height and width of the exemplar; again when a
//                                         base gives way to another one, or to the surface: meshes and textures are then of its charts
//      meshes {pieces, counts}            geometry of the charts that changed
//      textures {entries, state}          changed textures, and the state that they show. An entry has a target (color, normal …)
//                                         and is `data` for a chart; or the gutter only, `gutter`.
//                                         Where the page paints: a map's sample, `sheet`; of what a chart is painted,
//                                         `recipe` (see recipes.js); or a chart without data, which is to be painted of these
//      state {state}                      where decoding stands
//      error {message, offset}            the stream is damaged

import { serve } from './worker/serve.js'

if (typeof WorkerGlobalScope !== 'undefined') serve(globalThis)
