"""The module against a plane known in closed form: test_rugae.py PLANE_DATASET_PROGRAM."""
import os
import pickle
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import rugae

PROGRAM = sys.argv.pop(1)
NORMAL = np.array([0.1, -0.2, -1.0]) / np.linalg.norm([0.1, -0.2, -1.0])
OFFSET_MM = -30.0
FLOAT32 = 1e-5  # of depths of 30 mm and flows of a few px


def pixel_grid(lens):
    """Centres of all pixels, (rows * columns, 2)."""
    x, y = np.meshgrid(np.arange(lens.width) + 0.5, np.arange(lens.height) + 0.5)
    return np.stack([x.ravel(), y.ravel()], axis=1)


class WavyWall:
    """A mottled wall in waves before a pinhole camera that looks along z."""
    WIDTH, HEIGHT, FOCAL_PX = 320, 240, 220.0

    def __init__(self):
        random = np.random.default_rng(1)
        noise = np.fft.fft2(random.standard_normal((512, 512)))
        f = np.hypot(*np.meshgrid(np.fft.fftfreq(512), np.fft.fftfreq(512)))
        mottle = np.fft.ifft2(noise * np.exp(-(f / 0.06) ** 2)).real
        self.texture = 128 + 40 * mottle / mottle.std()  # 5 texels a mm, repeated

    def calibration(self):
        return (f"model: brown_conrady\nwidth: {self.WIDTH}\nheight: {self.HEIGHT}\nfx: {self.FOCAL_PX}\n"
                f"fy: {self.FOCAL_PX}\ncx: {self.WIDTH / 2}\ncy: {self.HEIGHT / 2}\n")

    def picture(self, centre_mm):
        x, y = np.meshgrid(np.arange(self.WIDTH) + 0.5, np.arange(self.HEIGHT) + 0.5)
        ray = np.stack([(x - self.WIDTH / 2) / self.FOCAL_PX, (y - self.HEIGHT / 2) / self.FOCAL_PX])
        depth = np.full(x.shape, 30.0)
        for _ in range(30):  # where the ray meets the wall
            at = centre_mm[:2, None, None] + ray * depth
            depth = 30 + 3 * np.sin(at[0] / 5) * np.cos(at[1] / 5) - centre_mm[2]
        whole = np.floor(5 * at)
        (u, v), (fu, fv) = whole.astype(int) % 512, 5 * at - whole
        t, s = self.texture, (u + 1) % 512
        w = (v + 1) % 512
        gray = (1 - fv) * ((1 - fu) * t[v, u] + fu * t[v, s]) + fv * ((1 - fu) * t[w, u] + fu * t[w, s])
        return np.repeat(np.clip(gray, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


class RugaeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dataset_path = os.path.join(cls.folder.name, "dataset")
        cls.estimate_path = os.path.join(cls.folder.name, "estimate")
        subprocess.run([PROGRAM, cls.dataset_path, cls.estimate_path], check=True)
        cls.dataset = rugae.Dataset(cls.dataset_path)
        cls.estimate = rugae.Estimate(cls.estimate_path)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def lift(self, index):
        """Points of all pixels of a frame in its camera, and in the world."""
        lens = self.dataset.lens
        rays = lens.unproject(pixel_grid(lens))
        points = rays * (self.dataset.depth_mm(index).ravel() / rays[:, 2])[:, None]
        pose = self.dataset.world_from_camera[index]
        return points, points @ pose[:3, :3].T + pose[:3, 3]

    def test_shapes_and_types(self):
        d = self.dataset
        self.assertEqual(len(d), 6)
        self.assertEqual(d.world_from_camera.shape, (6, 4, 4))
        self.assertEqual(d.times_s.shape, (6,))
        for array, shape, dtype in [(d.image(0), (48, 64, 3), np.uint8), (d.depth_mm(0), (48, 64), np.float32),
                                    (d.normal(0), (48, 64, 3), np.float32), (d.masks(0), (48, 64), np.uint8),
                                    (d.flow_px(0), (48, 64, 2), np.float32)]:
            self.assertEqual(array.shape, shape)
            self.assertEqual(array.dtype, dtype)
        self.assertIsNone(d.flow_px(5))
        np.testing.assert_array_equal(d.image(-1), d.image(5))
        with self.assertRaises(IndexError):
            d.image(6)

    def test_lens_round_trip(self):
        lens = self.dataset.lens
        pixels = pixel_grid(lens)
        np.testing.assert_allclose(lens.project(lens.unproject(pixels) * 17.0), pixels, rtol=0, atol=1e-9)
        self.assertTrue(np.isnan(lens.project([[0.0, 0.0, -1.0]])).all())
        self.assertEqual(lens.matrix()[0, 2], lens.cx)
        with self.assertRaises(ValueError):
            lens.project([1.0, 2.0, 3.0])

    def test_lifted_depth_lies_on_the_plane(self):
        for index in range(len(self.dataset)):
            _, world = self.lift(index)
            np.testing.assert_allclose(world @ NORMAL, OFFSET_MM, rtol=0, atol=FLOAT32)

    def test_image_is_rgb(self):
        # The plane's red is a sine of x + y, its blue a sine of x alone.
        _, world = self.lift(0)
        red = 127.5 + 100.0 * np.sin(world[:, 0] + world[:, 1])
        blue = 127.5 + 100.0 * np.sin(1.1 * world[:, 0])
        image = self.dataset.image(0).reshape(-1, 3)
        self.assertLessEqual(np.abs(image[:, 0] - red).max(), 1.001)
        self.assertLessEqual(np.abs(image[:, 2] - blue).max(), 1.001)

    def test_flow_is_reprojection(self):
        d = self.dataset
        for index in range(len(d) - 1):
            _, world = self.lift(index)
            pose = np.linalg.inv(d.world_from_camera[index + 1])
            seen = d.lens.project(world @ pose[:3, :3].T + pose[:3, 3])
            valid = (d.masks(index).ravel() & rugae.MASK_FLOW_VALID) != 0
            flow = d.flow_px(index).reshape(-1, 2)
            self.assertGreater(valid.mean(), 0.5)
            np.testing.assert_allclose((pixel_grid(d.lens) + flow)[valid], seen[valid], rtol=0, atol=FLOAT32)
            self.assertTrue(np.isnan(flow[~valid]).all())

    def test_normals(self):
        for index in range(len(self.dataset)):
            expected = self.dataset.world_from_camera[index][:3, :3].T @ NORMAL
            np.testing.assert_allclose(self.dataset.normal(index).reshape(-1, 3),
                                       np.broadcast_to(expected, (48 * 64, 3)), rtol=0, atol=3.2e-5)

    def test_wall(self):
        self.assertEqual(self.dataset.wall_triangles.shape, (2, 3))
        np.testing.assert_allclose(self.dataset.wall_vertices_mm @ NORMAL, OFFSET_MM, rtol=0, atol=1e-12)

    def test_presets(self):
        camera = rugae.load_camera("misumi-v5506")
        self.assertEqual((camera.lens.width, camera.lens.height, camera.fps), (640, 480, 30.0))
        with self.assertRaisesRegex(rugae.Error, "did you mean 'misumi-v5506'"):
            rugae.load_camera("misumi-v550")

    def test_errors_name_the_file(self):
        with self.assertRaisesRegex(ValueError, "no-such-folder: no such folder"):
            rugae.Dataset("no-such-folder")

    def test_check(self):
        self.assertEqual(rugae.check(self.dataset_path), [])

    def test_evaluate_of_another_program(self):
        with tempfile.TemporaryDirectory() as folder:
            rugae.export(self.dataset_path, "tum", folder + "/tum", depth_per_mm=100)
            m = rugae.evaluate(self.dataset_path, folder + "/tum/groundtruth.txt", mm_per_unit=1000,
                               depth=folder + "/tum/depth", depth_scale=1e-5)
            self.assertLess(m["trajectory"]["ate_se3_rmse_mm"], 1e-6)
            self.assertLess(m["depth"]["as_given"]["rmse_mm"], 0.005)
            self.assertEqual(m["depth"]["as_given"]["frames"], len(self.dataset))

    def test_export(self):
        with tempfile.TemporaryDirectory() as folder:
            notes = rugae.export(self.dataset_path, "tum", folder + "/tum")
            self.assertTrue(any("depth factor is 5000" in note for note in notes), notes)
            poses = np.loadtxt(folder + "/tum/groundtruth.txt")
            np.testing.assert_allclose(poses[:, 1:4], 1e-3 * self.dataset.world_from_camera[:, :3, 3], rtol=0, atol=1e-12)
            with self.assertRaisesRegex(rugae.Error, "did you mean 'tum'"):
                rugae.export(self.dataset_path, "tun", folder + "/other")

    def test_estimate(self):
        e = self.estimate
        self.assertEqual((len(e), e.method, e.numbers["keyframes"]), (6, "test", 5.0))
        self.assertEqual(e.states, ["keyframe", "keyframe", "lost", "keyframe", "keyframe", "keyframe"])
        self.assertTrue(np.isnan(e.world_from_camera[2]).all())
        self.assertEqual(e.map_triangles.shape, (2, 3))
        self.assertEqual(e.points.shape, (4, 3))
        self.assertIsNone(e.depth(0))
        np.testing.assert_array_equal(e.depth(-5), e.depth(1))
        for outside in (6, -7):
            with self.assertRaises(IndexError):
                e.depth(outside)
        np.testing.assert_allclose(e.depth(1), 0.5 * self.dataset.depth_mm(1), rtol=1e-6)

    def test_umeyama(self):
        tracked = [i for i in range(6) if i != 2]
        source = self.estimate.world_from_camera[tracked, :3, 3]
        target = self.dataset.world_from_camera[tracked, :3, 3]
        scale, rotation, translation = rugae.umeyama(source, target)
        self.assertAlmostEqual(scale, 2.0, places=9)
        np.testing.assert_allclose(scale * source @ rotation.T + translation, target, rtol=0, atol=1e-9)
        self.assertIsNone(rugae.umeyama(source[:2], target[:2]))

    def test_live_reconstruction(self):
        camera = WavyWall()
        folder = os.path.join(self.folder.name, "live")
        lens = os.path.join(self.folder.name, "lens.yaml")
        with open(lens, "w") as file:
            file.write(camera.calibration())
        live = rugae.Reconstruction(folder, lens)
        estimated, true = [], []
        for i in range(16):
            centre = np.array([1.2 * i, 0.3 * i, 0.2 * i])
            live.add(pickle.loads(pickle.dumps(camera.picture(centre))), i / 30.0)  # as from another process
            pose = live.pose()
            if pose is not None:
                estimated.append(pose[:3, 3])
                true.append(centre)
        self.assertEqual(len(live), 16)
        self.assertGreaterEqual(len(true), 11)
        estimated, true = np.array(estimated), np.array(true)
        # The path is a line, along which rotation is not determined: distances alone.
        distances = np.linalg.norm(estimated - estimated[0], axis=1), np.linalg.norm(true - true[0], axis=1)
        scale = distances[0] @ distances[1] / (distances[0] @ distances[0])
        np.testing.assert_allclose(scale * distances[0], distances[1], rtol=0, atol=0.02 * distances[1][-1])
        self.assertGreater(len(live.points()), 100)
        vertices, triangles = live.map()
        self.assertGreater(len(triangles), 100)
        self.assertLess(triangles.max(), len(vertices))
        with self.assertRaisesRegex(rugae.Error, "expected after"):
            live.add(camera.picture(np.zeros(3)), 0.0)
        with self.assertRaisesRegex(ValueError, "shape"):
            live.add(np.zeros((4, 4), np.uint8), 9.0)
        with self.assertRaisesRegex(TypeError, "float32, expected uint8"):
            live.add(np.zeros((4, 4, 3), np.float32), 9.0)
        estimate = live.finish(os.path.join(self.folder.name, "live-estimate"))
        self.assertEqual((len(estimate), estimate.states.count("lost")), (16, 0))
        with self.assertRaisesRegex(rugae.Error, "was finished"):
            live.pose()

    def test_evaluate(self):
        metrics = rugae.evaluate(self.dataset_path, self.estimate_path)
        # The estimate is right up to a similarity. Its depth is half the truth's in mm, whose float32 limits the rest.
        self.assertLessEqual(metrics["trajectory"]["ate_sim3_rmse_mm"], 1e-9)


if __name__ == "__main__":
    unittest.main()
