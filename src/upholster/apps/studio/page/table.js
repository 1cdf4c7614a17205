/** The sample table: which part of a photo is the sample, seen from the front and evenly lit, and its size. */

import { button, make, openDialog } from './dom.js'
import { METRES } from './lengths.js'

const SVG = 'http://www.w3.org/2000/svg'
const INSET = 0.12 // initial margin of corners and crop, as a share of the photo
const WAIT = 250 // milliseconds from a change until the sample is prepared again

const clamp = (x, most) => Math.min(Math.max(x, 0), most)
const drawn = (tag, attributes) => {
  const element = document.createElementNS(SVG, tag)
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value)
  return element
}

/**
 * Handles on a picture that can be dragged, or moved by arrow keys. `size` is the picture's width and height, `points` its handles'
 * places in its pixels, `shape(points)` the points of the polygon between them; `onmove(n, place)` returns nothing and changes `points`.
 */
function handled(image, size, points, names, shape, onmove) {
  const [width, height] = size
  const svg = drawn('svg', { viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: 'none' })
  const polygon = drawn(points.length > 2 ? 'polygon' : 'polyline', { class: 'shape', 'vector-effect': 'non-scaling-stroke' })
  svg.append(polygon)
  const lens = make('div', { className: 'lens', hidden: true })
  const element = framed(image, width / height)
  element.append(svg, lens)
  const handles = points.map((_, n) => {
    const handle = button('', null, { className: 'handle', ariaLabel: names[n] })
    const place = (event) => {
      const { left, top, width: w, height: h } = element.getBoundingClientRect()
      return [clamp(((event.clientX - left) / w) * width, width), clamp(((event.clientY - top) / h) * height, height)]
    }
    handle.onpointerdown = (event) => {
      handle.setPointerCapture(event.pointerId)
      lens.hidden = false
      look(n)
    }
    handle.onpointermove = (event) => handle.hasPointerCapture(event.pointerId) && move(n, place(event))
    handle.onpointerup = handle.onpointercancel = () => (lens.hidden = true)
    handle.onkeydown = (event) => {
      const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key]
      if (!by) return
      event.preventDefault()
      const step = event.shiftKey ? 10 : 1
      move(n, [clamp(points[n][0] + step * by[0], width), clamp(points[n][1] + step * by[1], height)])
    }
    element.append(handle)
    return handle
  })
  const move = (n, place) => {
    onmove(n, place)
    show()
    look(n)
  }
  /** The place of a handle, four times as large, in the corner away from it. */
  const look = (n) => {
    const { width: w, height: h } = element.getBoundingClientRect()
    const [x, y] = [(points[n][0] / width) * w, (points[n][1] / height) * h]
    lens.classList.toggle('right', x < w / 2)
    Object.assign(lens.style, {
      backgroundImage: `url("${image.src}")`,
      backgroundSize: `${4 * w}px ${4 * h}px`,
      backgroundPosition: `${60 - 4 * x}px ${60 - 4 * y}px`,
    })
  }
  const show = () => {
    polygon.setAttribute('points', shape(points).map((one) => one.join(',')).join(' '))
    handles.forEach((handle, n) => Object.assign(handle.style, { left: `${(100 * points[n][0]) / width}%`, top: `${(100 * points[n][1]) / height}%` }))
  }
  show()
  return Object.assign(element, { show })
}

/** A picture that fills the room, not distorted. */
function framed(image, aspect) {
  const element = make('div', { className: 'handled' }, image)
  element.style.inlineSize = `min(100%, calc(50vh * ${aspect}))`
  return element
}

/**
 * Open the table.
 * @param {object} given `picture`, the photo's address; `width` and `height` of the photo; `options` of the sample so far; `preview(options)`
 *   resolves to the sample read with options, see `api.prepared`; `hints` resolves to suggestions, see `api.hints`
 * @returns {Promise<object | null>} the sample's new options: `rectify`, `crop`, `even_light`, `size`; null: unchanged
 */
export function openTable({ picture, width, height, options, preview, hints }) {
  const inner = [INSET * width, INSET * height, (1 - INSET) * width, (1 - INSET) * height]
  const corners = options.rectify?.map((one) => [...one]) ?? [0, 1, 2, 3].map((n) => [inner[n === 1 || n === 2 ? 2 : 0], inner[n > 1 ? 3 : 1]])
  const [x, y, w, h] = options.crop ?? [inner[0], inner[1], inner[2] - inner[0], inner[3] - inner[1]]
  const box = [[x, y], [x + w, y + h]] // prettier-ignore
  let mode = options.rectify ? 'corners' : options.crop ? 'crop' : 'whole'
  let light = Boolean(options.even_light)
  let isMoved = Boolean(options.rectify) // whether the user has moved the corners
  const line = [[200, 500], [800, 500]] // prettier-ignore
  let prepared = null // width and height of the sample as it is read

  const chosen = () => ({
    rectify: mode === 'corners' ? corners.map((one) => one.map((v) => Math.round(10 * v) / 10)) : null,
    crop: mode === 'crop' ? [box[0][0], box[0][1], box[1][0] - box[0][0], box[1][1] - box[0][1]].map((v, n) => Math.max(n > 1 ? 1 : 0, Math.round(v))) : null,
    even_light: light || null,
  })
  const photo = () => make('img', { src: picture, alt: 'The photo', draggable: false })
  const square = ([[a, b], [c, d]]) => [[a, b], [c, b], [c, d], [a, d]] // prettier-ignore
  const left = make('div', { className: 'photo' })
  const showPhoto = () => {
    if (mode === 'corners') {
      const names = ['Top left corner', 'Top right corner', 'Bottom right corner', 'Bottom left corner']
      left.replaceChildren(handled(photo(), [width, height], corners, names, (points) => points, (n, place) => change(() => ((corners[n] = place), (isMoved = true)))))
    } else if (mode === 'crop') {
      const moved = (n, place) => change(() => (box[n] = place.map((v, k) => (n ? Math.max(v, box[0][k] + 8) : Math.min(v, box[1][k] - 8)))))
      left.replaceChildren(handled(photo(), [width, height], box, ['Top left of the part', 'Bottom right of the part'], square, moved))
    } else left.replaceChildren(framed(photo(), width / height))
  }

  const image = make('img', { alt: 'The sample as it is read', draggable: false })
  const wrong = make('p', { className: 'wrong' })
  const found = make('figcaption', {})
  let [timer, asked, isOwn] = [0, 0, false] // whether the user has moved the line
  let isShown = Promise.resolve() // the sample with the present options
  const showPrepared = async () => {
    const number = ++asked
    try {
      const answer = await preview(read(chosen()))
      if (number !== asked) return
      URL.revokeObjectURL(image.src)
      image.src = URL.createObjectURL(answer.picture)
      prepared = [answer.width, answer.height]
      ruler.style.inlineSize = `min(100%, calc(50vh * ${answer.width / answer.height}))`
      wrong.textContent = ''
      layLine(answer)
    } catch (error) {
      if (number === asked) wrong.textContent = error.message
    }
  }
  /** Lay the line along one repeating element, if there is one; the user may know its length. */
  const layLine = ({ element, width, height }) => {
    const [across, down] = element
    found.textContent = !element.length
      ? 'The sample: draw the line across something whose length you know.'
      : down
        ? `It repeats every ${Math.round(across)} × ${Math.round(down)} pixels. The line spans the width of one element.`
        : `Its rows are ${Math.round(across)} pixels apart. The line spans the distance from one to the next.`
    if (!isOwn && element.length) {
      const half = Math.min(480, (500 * across) / (down ? width : height))
      if (down) line.splice(0, 2, [500 - half, 500], [500 + half, 500])
      else line.splice(0, 2, [500, 500 - half], [500, 500 + half])
      ruler.show()
    }
    showSize()
  }
  const show = () => {
    clearTimeout(timer)
    isShown = new Promise((resolve) => (timer = setTimeout(() => showPrepared().then(resolve), WAIT)))
  }
  const change = (work) => {
    work()
    show()
  }

  // The size: a line across something whose length is known.
  const length = make('input', { type: 'text', placeholder: '21cm', ariaLabel: 'Length of what the line crosses', className: 'short' })
  const sizeText = make('span', { className: 'value' })
  const size = () => {
    const found = /^\s*([0-9.]+)\s*([a-z]*)\s*$/.exec(length.value)
    if (!found || !prepared || (found[2] && !Object.hasOwn(METRES, found[2]))) return null
    const [a, b] = line
    const across = Math.hypot(((b[0] - a[0]) / 1000) * prepared[0], ((b[1] - a[1]) / 1000) * prepared[1])
    return across > 0 ? `${Number(((Number(found[1]) * prepared[0]) / across).toPrecision(4))}${found[2]}` : null
  }
  const showSize = () => (sizeText.textContent = size() ? `the sample is ${size()} wide` : '')
  length.oninput = showSize
  const ruler = handled(image, [1000, 1000], line, ['One end of the line', 'Other end of the line'], (points) => points, (n, place) => {
    line[n] = place
    isOwn = true
    showSize()
  })

  const modes = [['whole', 'Whole photo'], ['crop', 'A part'], ['corners', 'Four corners']].map(([value, text]) => {
    const radio = make('input', { type: 'radio', name: 'mode', checked: mode === value })
    radio.onchange = () => change(() => ((mode = value), showPhoto()))
    return make('label', {}, radio, ` ${text}`)
  })
  const evenly = make('input', { type: 'checkbox', checked: light })
  evenly.onchange = () => change(() => (light = evenly.checked))

  const advice = make('div', { className: 'advice' })
  const advise = (text, name, act) => {
    const line = make('p', {}, `${text} `, button(name, () => (line.remove(), act())))
    advice.append(line)
  }
  hints.then((found) => {
    if (found.corners && !isMoved) {
      corners.splice(0, 4, ...found.corners)
      if (mode === 'corners') showPhoto()
      else advise('The photo was taken at an angle, it seems.', 'Use four corners', () => modes[2].click())
    }
    if (found.light > found.uneven && !light) advise(`The light varies by a factor of ${found.light.toFixed(1)}.`, 'Even light', () => evenly.click())
  }, () => {}) // errors of the photo are shown below it

  showPhoto()
  show()
  return new Promise((resolve) => {
    const end = (value) => {
      resolve(value)
      close()
    }
    const close = openDialog(
      'Prepare the sample',
      make('div', { className: 'row modes' }, ...modes, make('label', {}, evenly, ' Even light')),
      advice,
      make(
        'div',
        { className: 'table' },
        make('figure', {}, left, make('figcaption', {}, 'The photo: drag the corners to something rectangular, such as a door or a few bricks.')),
        make('figure', {}, ruler, found, wrong),
      ),
      make('div', { className: 'row' }, 'This line is', length, 'long:', sizeText),
      make(
        'div',
        { className: 'end' },
        button('Cancel', () => end(null), { className: 'quiet' }),
        button('Use it', () => isShown.then(() => end({ ...chosen(), ...(size() ? { size: size() } : {}) })), { className: 'main' }),
      ),
    )
    document.getElementById('dialog').addEventListener('close', () => resolve(null), { once: true })
  })
}

/** Options without those that are null. */
const read = (options) => Object.fromEntries(Object.entries(options).filter(([, value]) => value !== null))
