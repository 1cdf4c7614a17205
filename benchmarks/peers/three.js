// A GLB with Draco in three.js, as its examples show one: it is drawn when it is here, and when somebody turns it.

import { AmbientLight, Box3, Color, DirectionalLight, PerspectiveCamera, Scene, Sphere, Vector3, WebGLRenderer } from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js'
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js'

const decoder = new DRACOLoader().setDecoderPath('').preload()
const loading = new GLTFLoader().setDRACOLoader(decoder).loadAsync(globalThis.model)

const renderer = new WebGLRenderer({ canvas: document.querySelector('canvas'), antialias: true })
renderer.setPixelRatio(devicePixelRatio)
renderer.setSize(innerWidth, innerHeight)
const scene = new Scene()
scene.background = new Color(0xe8e8e8)
const camera = new PerspectiveCamera(30, innerWidth / innerHeight)
const lamp = new DirectionalLight(0xffffff, 2.4)
lamp.position.set(-0.6, 0.7, 0.6)
scene.add(camera.add(lamp), new AmbientLight(0xffffff, 2))

const { scene: model } = await loading
scene.add(model)
const { center, radius } = new Box3().setFromObject(model).getBoundingSphere(new Sphere())
const distance = (0.65 * radius) / Math.sin((15 * Math.PI) / 180)
camera.near = distance / 100
camera.far = 3 * distance
camera.position.copy(center).add(new Vector3().setFromSphericalCoords(distance, Math.PI / 3, Math.PI / 6))
camera.updateProjectionMatrix()
const controls = new OrbitControls(camera, renderer.domElement)
controls.target.copy(center)
controls.addEventListener('change', () => renderer.render(scene, camera))
controls.update()
renderer.render(scene, camera)
dispatchEvent(new Event('complete'))
