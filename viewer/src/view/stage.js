// The place where a scene is seen: renderer, light, camera, and the reader's hand on them. Draws only when something changed,
// and holds a WebGL context only while it is near the screen, since a browser gives a page a few of them.

import {DirectionalLight, HemisphereLight, MathUtils, PerspectiveCamera, Scene, Vector3, WebGLRenderer} from "three";
import {OrbitControls} from "three/addons/controls/OrbitControls.js";

import {placeAt} from "./capsule.js";

const kFov_deg = 38, kMostFov_deg = 130, kClick_px = 6;
const kFrom = new Vector3(0.42, -1, 0.28).normalize();  // the organ's front, a little from its left and above

export class Stage {
  /** `host` is the element to fill; `onClick(x, y)` gets places in it, in px. */
  constructor(host, onClick) {
    this.host = host;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(kFov_deg, 1, 0.4, 4000);
    this.camera.up.set(0, 0, 1);
    this.light = new DirectionalLight(0xffffff, 1.9);
    this.scene.add(this.camera, new HemisphereLight(0xffffff, 0xd8c4bc, 1.5));
    this.camera.add(this.light);
    this.light.position.set(0.3, 0.5, 1);
    this.camera.add(this.light.target);
    this.light.target.position.set(0, 0, -1);
    this.controls = new OrbitControls(this.camera, host);
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 2;
    this.controls.addEventListener("change", () => this.invalidate());
    this.listenForClicks(onClick);
    new ResizeObserver(() => this.resize()).observe(host);
    new IntersectionObserver(([entry]) => (entry.isIntersecting ? this.wake() : this.sleep()),
                             {rootMargin: "300px"}).observe(host);
  }

  wake() {
    if (this.renderer) return;
    try {
      this.renderer = new WebGLRenderer({antialias: true, alpha: true});
    } catch {
      this.host.classList.add("no-webgl");
      return;
    }
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.host.prepend(this.renderer.domElement);
    this.resize();
  }

  sleep() {
    if (!this.renderer) return;
    this.renderer.domElement.remove();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.renderer = null;
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.host;
    if (!this.renderer || !width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  invalidate() {
    if (this.pending || !this.renderer) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = null;
      this.renderer?.render(this.scene, this.camera);
    });
  }

  /** The whole of a sphere in view, from the organ's front. */
  frame(sphere) {
    const halfAngle = MathUtils.degToRad(kFov_deg / 2) * Math.min(1, this.host.clientWidth / (this.host.clientHeight || 1));
    this.camera.fov = kFov_deg;
    this.camera.updateProjectionMatrix();
    this.controls.enabled = true;
    this.controls.target.copy(sphere.center);
    this.controls.maxDistance = 12 * sphere.radius;
    this.camera.position.copy(sphere.center).addScaledVector(kFrom, (1.02 * sphere.radius) / Math.sin(halfAngle));
    this.controls.update();
    this.invalidate();
  }

  /** From where the capsule was, the way it looked; the whole frame is in view. */
  lookFrom(pose, cornerRays) {
    this.controls.enabled = false;
    placeAt(this.camera, pose);
    this.camera.rotateX(Math.PI);  // from y down, z forward to y up, z backward
    const slopes = cornerRays.map(([x, y, z]) => Math.max(Math.abs(y), Math.abs(x) / this.camera.aspect) / Math.max(z, 1e-3));
    const fov_deg = 2 * MathUtils.radToDeg(Math.atan(Math.max(...slopes, 0.3)));
    this.camera.fov = Math.min(fov_deg, kMostFov_deg);
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  /** Where a point of the world is on the screen, px in the host; null behind the eye. */
  onScreen(point) {
    const p = new Vector3(...point).project(this.camera);
    if (p.z > 1) return null;
    return [((p.x + 1) / 2) * this.host.clientWidth, ((1 - p.y) / 2) * this.host.clientHeight];
  }

  // A press that does not move.
  listenForClicks(onClick) {
    let down = null;
    this.host.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    this.host.addEventListener("pointerup", (event) => {
      const moved = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]);
      down = null;
      if (moved === null || moved > kClick_px) return;
      const box = this.host.getBoundingClientRect();
      onClick(event.clientX - box.left, event.clientY - box.top);
    });
  }
}
