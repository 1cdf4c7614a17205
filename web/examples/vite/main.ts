import { Color, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from 'three'
import { UphLoader, type UphModel } from 'upholster/three'

const canvas = document.querySelector('canvas')!
const renderer = new WebGLRenderer({ canvas, antialias: true })
const scene = new Scene()
scene.background = new Color(0xdddddd)
scene.add(new HemisphereLight(0xffffff, 0x888888, 3))
const camera = new PerspectiveCamera(40, 1, 0.01, 1000)
camera.up.set(0, 0, 1)

/** Draw when there is something new to see, not all the time. */
function draw(model: UphModel) {
  renderer.setSize(innerWidth, innerHeight, false)
  camera.aspect = innerWidth / innerHeight
  camera.updateProjectionMatrix()
  renderer.render(scene, camera)
  document.body.dataset.complete = String(model.complete)
}

const model = await new UphLoader().loadAsync('ring.uph', ({ received, total }) => console.info(`${received} of ${total} bytes`))
const { center, radius } = model.sphere
camera.position.set(1, -2, 1).setLength(3 * radius).add(center)
camera.lookAt(center)
scene.add(model)
for (const type of ['refine', 'geometry', 'complete'] as const) model.addEventListener(type, () => draw(model))
addEventListener('resize', () => draw(model))
draw(model)
