/** Painting on the graphics card, which the viewer loads where there is one. */

export { ChartPainter } from './viewer/painter.js'
