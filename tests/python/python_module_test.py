"""The module against the programs: the same bytes, and NumPy's own arithmetic."""

import ast
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
import unittest

import numpy as np

import lumigraph as lg
import scenes

sys.path.insert(0, str(scenes.SOURCE / "python/examples"))
from own_weights import blend  # noqa: E402


class Arrays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = lg.open_scene(scenes.desk())

    def test_matrices_are_made_of_cameras_and_poses(self):
        s = self.scene
        np.testing.assert_allclose(s.P, s.K @ s.cam_from_world, rtol=0, atol=1e-9)
        R, t = s.cam_from_world[:, :, :3], s.cam_from_world[:, :, 3]
        np.testing.assert_allclose(s.centres, -np.einsum("nji,nj->ni", R, t), atol=1e-12)
        self.assertEqual(s.names, sorted(s.names))
        self.assertEqual(len(s), 24)

    def test_observations_are_where_points_project(self):
        view, point, x_px = self.scene.observations()
        X = self.scene.points[point]
        x = np.einsum("nij,nj->ni", self.scene.P[view][:, :, :3], X) + self.scene.P[view][:, :, 3]
        errors = np.linalg.norm(x[:, :2] / x[:, 2:] - x_px, axis=1)
        self.assertTrue((x[:, 2] > 0).all())
        self.assertLess(np.median(errors), 1.0)
        mean = np.bincount(point, errors) / np.bincount(point)
        np.testing.assert_allclose(mean, self.scene.point_errors_px, atol=1e-6)

    def test_points_and_meshes_are_not_copied_and_cannot_be_written(self):
        for array in self.scene.points, self.scene.point_colors, self.scene.proxy().vertices, self.scene.proxy().faces:
            self.assertFalse(array.flags.owndata)
            self.assertFalse(array.flags.writeable)
            with self.assertRaises(ValueError):
                array[0] = 0

    def test_an_array_outlives_what_it_lies_in(self):
        points = lg.open_scene(scenes.desk()).points
        photo = lg.open(scenes.desk()).photo("0")
        for _ in range(3):
            lg.open_scene(scenes.desk())
        np.testing.assert_array_equal(points, self.scene.points)
        self.assertEqual(photo.shape[2], 3)

    def test_a_mesh_comes_back_from_its_file(self):
        mesh = self.scene.proxy()
        file = scenes.scratch() / "again.ply"
        mesh.save(file)
        again = lg.Mesh.read(file)
        np.testing.assert_array_equal(again.vertices, mesh.vertices)
        np.testing.assert_array_equal(again.faces, mesh.faces)
        with self.assertRaisesRegex(ValueError, "shape"):
            lg.Mesh([[0, 0, 0]], [[0, 0]])
        with self.assertRaises(ValueError):
            lg.Mesh([[0, 0, 0]], [[0, 0, 7]])

    def test_views_of_any_kind_agree(self):
        s = self.scene
        of_photo = s.view(s.names[3])
        made = lg.View.from_camera(s.K[3], s.cam_from_world[3], of_photo.size_px)
        np.testing.assert_allclose(made.P, of_photo.P, atol=1e-9)
        of_matrix = lg.View(of_photo.P, of_photo.size_px)
        np.testing.assert_allclose(of_matrix.centre, of_photo.centre, atol=1e-9)
        eye = np.array([1.0, 2.0, 3.0])
        looking = lg.View.look_at(eye, [0, 0, 0], [0, 0, 1], 45, (200, 100))
        x = looking.P @ [0, 0, 0, 1]
        np.testing.assert_allclose(x[:2] / x[2], [100, 50], atol=1e-9)
        np.testing.assert_allclose(looking.centre, eye, atol=1e-12)
        with self.assertRaisesRegex(ValueError, "no finite centre"):
            lg.View(np.eye(3, 4) * [[1], [1], [0]], (10, 10))


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.lum = lg.open(scenes.desk())
        cls.name = cls.lum.scene.names[5]
        cls.view = cls.lum.scene.view(cls.name)

    def of_program(self, *arguments):
        output = scenes.scratch() / "of-program"
        scenes.run("lumi-render", scenes.desk(), "-o", output, "--view", self.name, *arguments)
        return (output / (pathlib.Path(self.name).stem + ".png")).read_bytes()

    def of_module(self, picture):
        file = scenes.scratch() / "of-module.png"
        picture.save(file)
        return file.read_bytes()

    def test_a_picture_is_lumi_renders_byte_for_byte(self):
        self.assertEqual(self.of_module(self.lum.render(self.view)), self.of_program())
        self.assertEqual(self.of_module(self.lum.render(self.view, leave_out=[self.name])), self.of_program("--leave-out"))

    def test_settings_mean_what_options_mean(self):
        for settings, options in [
            ({"k": 2, "resolution": "jacobian"}, ["--k", "2", "--resolution", "jacobian"]),
            ({"similarity": "full", "r_max_deg": 4}, ["--similarity", "full", "--r-max-deg", "4"]),
            ({"grid": "9x9"}, ["--grid", "9x9"]),
            ({"fov": False, "visibility": False}, ["--fov", "off", "--visibility", "off"]),
        ]:
            with self.subTest(settings=settings):
                lum = lg.open(scenes.desk(), settings=settings)
                self.assertEqual(self.of_module(lum.render(self.view, [self.name])), self.of_program("--leave-out", *options))

    def test_settings_come_back_as_a_dictionary(self):
        self.lum.render(self.view)
        again = lg.open(scenes.desk(), settings=self.lum.settings)
        again.render(self.view)
        self.assertEqual(again.settings, self.lum.settings)
        # A time is no setting where each picture has its own.
        self.assertEqual({o["name"] for o in lg.setting_options()}, set(self.lum.settings) | {"time-s"})

    def test_a_film_has_its_own_times_after_a_round_trip(self):
        lum = lg.open(scenes.lamp())
        views = [lum.scene.view(0, width=64), lum.scene.view(20, width=64)]
        lum.choose_measures(views)
        self.assertTrue(lum.settings["time"])
        again = lg.open(scenes.lamp(), settings=lum.settings)
        for view in views:
            np.testing.assert_array_equal(again.render(view).rgb, lum.render(view).rgb)
        with self.assertRaisesRegex(lg.UsageError, "counts for all pictures"):
            lum.render(views[0], settings={"time_s": 1})

    def test_numpys_blend_of_the_plan_is_the_picture(self):
        lum = lg.open(scenes.desk(), settings={"prefilter": "off", "exposure": "off"})
        plan = lum.plan(self.view, leave_out=[self.name])
        covered = plan.alpha > 0
        self.assertGreater(covered.mean(), 0.5)
        np.testing.assert_allclose(plan.weights.sum(axis=2)[covered], 1, atol=1e-5)
        self.assertNotIn(lum.scene.names.index(self.name), plan.photos)
        mine = np.clip(np.rint(blend(lum, plan, plan.weights)), 0, 255)
        ours = lum.render(self.view, leave_out=[self.name]).rgb
        # Where a weight vanishes at the photo's border the renderer's own rule for the border counts.
        self.assertLessEqual(np.abs(mine - ours).max(), 1)

    def test_weights_at_pixels_are_the_plans(self):
        plan = self.lum.plan(self.view, leave_out=[self.name])
        y, x = np.nonzero(plan.alpha == 1)
        xy = np.column_stack([x, y])[:: len(x) // 20] + 0.5
        self.assertGreaterEqual(len(xy), 20)
        at = self.lum.weights_at(self.view, xy, leave_out=[self.name])
        for i, (x, y) in enumerate(xy.astype(int)):
            entries = slice(at.first[i], at.first[i + 1])
            here = plan.photos[y, x] >= 0
            self.assertEqual(dict(zip(at.photos[entries], at.weights[entries])),
                             dict(zip(plan.photos[y, x][here], plan.weights[y, x][here])))
            np.testing.assert_allclose(at.points[i], plan.points[y, x], atol=1e-5)
        np.testing.assert_allclose(at.dense().sum(axis=1), 1, atol=1e-5)

    def test_the_optimums_weights_are_many_and_sum_to_one(self):
        xy = np.column_stack([np.linspace(20, 140, 50), np.full(50, 60.0)])
        at = self.lum.weights_at(self.view, xy, leave_out=[self.name], settings={"similarity": "full"})
        np.testing.assert_allclose(at.dense().sum(axis=1)[at.alpha > 0], 1, atol=1e-4)
        self.assertLess(at.dense().min(), 0)  # an interpolator's weights; the real-time ones never are

    def test_the_nearest_photo_is_given_back_at_its_own_camera(self):
        at = self.lum.weights_at(self.view, [[80.0, 60.0]])
        self.assertEqual(at.photos[np.argmax(at.weights)], self.lum.scene.names.index(self.name))
        self.assertGreater(at.weights.max(), 0.99)

    def test_measures_are_maps_of_values(self):
        angle, unit = self.lum.measure_map("angle", self.view, photo=self.lum.scene.names[0])
        self.assertEqual(unit, "deg")
        plan = self.lum.plan(self.view)
        to_view = plan.points - self.view.centre
        to_photo = plan.points - self.lum.scene.centres[0]
        cosine = (to_view * to_photo).sum(2) / np.linalg.norm(to_view, axis=2) / np.linalg.norm(to_photo, axis=2)
        both = np.isfinite(angle) & np.isfinite(cosine)
        self.assertGreater(both.mean(), 0.3)
        np.testing.assert_allclose(angle[both], np.degrees(np.arccos(np.clip(cosine[both], -1, 1))), atol=0.02)
        with self.assertRaisesRegex(lg.UsageError, "no measure colour"):
            self.lum.measure_map("colour", self.view)

    def test_a_mesh_of_ones_own_is_rendered_over(self):
        lum = lg.open(scenes.desk(), proxy=self.lum.mesh)
        np.testing.assert_array_equal(lum.render(self.view).rgb, self.lum.render(self.view).rgb)
        low, high = self.lum.mesh.vertices.min(0), self.lum.mesh.vertices.max(0)
        z = low[2]
        floor = lg.Mesh([[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z]],
                        [[0, 1, 2], [0, 2, 3]])
        (scenes.scratch() / "bare").mkdir(exist_ok=True)
        for part in "images", "sparse":
            if not (scenes.scratch() / "bare" / part).exists():
                os.symlink(scenes.desk() / part, scenes.scratch() / "bare" / part)
        points = lg.open(scenes.scratch() / "bare", proxy=floor).plan(self.view).points  # no proxy of its own
        np.testing.assert_allclose(points[np.isfinite(points[..., 2])][:, 2], z, atol=1e-5)

    def test_evaluation_is_lumi_renders(self):
        mine = lg.evaluate(scenes.desk(), holdout=8)
        printed = subprocess.run([scenes.BIN / "lumi-render", scenes.desk(), "--holdout", "8", "--json"], check=True,
                                 capture_output=True, text=True)
        theirs = json.loads(printed.stdout)
        for key in "psnr_mean_db", "psnr_seen_mean_db", "ssim_mean", "nearest_photo_psnr_mean_db":
            self.assertEqual(mine[key], theirs[key], key)

    def test_depth_is_along_the_axis(self):
        plan = self.lum.plan(self.view)
        met = np.isfinite(plan.depth)
        np.testing.assert_array_equal(met, np.isfinite(plan.points[..., 0]))
        self.assertTrue(met[plan.alpha > 0].all())
        j = self.lum.scene.names.index(self.name)
        in_cam = plan.points[met] @ self.lum.scene.cam_from_world[j][:, :3].T + self.lum.scene.cam_from_world[j][:, 3]
        np.testing.assert_allclose(in_cam[:, 2], plan.depth[met], rtol=1e-5)

    def test_pictures_with_a_proxy_of_their_own(self):
        lum = lg.open(scenes.desk(), proxy="per-view")
        output = scenes.scratch() / "per-view"
        scenes.run("lumi-render", scenes.desk(), "-o", output, "--view", self.name, "--leave-out", "--proxy", "per-view")
        picture = lum.render(self.view, leave_out=[self.name])
        self.assertEqual(self.of_module(picture), next(output.glob("*.png")).read_bytes())
        plan = lum.plan(self.view, leave_out=[self.name])
        self.assertNotIn(lum.scene.names.index(self.name), plan.photos)
        np.testing.assert_allclose(plan.weights.sum(axis=2)[plan.alpha > 0], 1, atol=1e-5)
        self.assertTrue(np.isfinite(plan.depth).any())
        self.assertIsNone(lum.mesh)

    def test_frames_of_a_steady_path_are_lumi_renders(self):
        scene, path = scenes.shaky()
        output = scenes.scratch() / "steady"
        scenes.run("lumi-render", scene, "-o", output, "--path", path)
        lum = lg.open(scene, along_matrices=True)
        views = lum.scene.path(path)
        lum.choose_measures(views)
        frames = sorted((output / "frames").glob("*.png"))
        self.assertEqual(len(frames), len(views))
        for i in 0, len(views) // 2, len(views) - 1:
            self.assertEqual(self.of_module(lum.render(views[i])), frames[i].read_bytes(), i)

    def test_other_threads_run_meanwhile(self):
        start, ran = threading.Event(), threading.Event()

        def work():
            start.wait()
            ran.set()

        thread = threading.Thread(target=work)
        thread.start()
        start.set()
        lg.evaluate(scenes.desk(), holdout=2)
        meanwhile = ran.is_set()
        thread.join()
        self.assertTrue(meanwhile)

    def test_threads_of_python_take_turns(self):
        expected = self.lum.render(self.view).rgb
        wrong = []

        def work():
            for _ in range(3):
                if not np.array_equal(self.lum.render(self.view).rgb, expected):
                    wrong.append(1)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for t in threads:
            t.start()
        for t in threads:
            t.join(timeout=300)
        self.assertFalse(any(t.is_alive() for t in threads))
        self.assertFalse(wrong)


class Failures(unittest.TestCase):
    def test_each_exit_code_has_its_name(self):
        with self.assertRaises(lg.UsageError) as nowhere:
            lg.open_scene(scenes.scratch() / "nowhere")
        self.assertEqual(nowhere.exception.code, 2)
        broken = scenes.scratch() / "broken"
        broken.mkdir(exist_ok=True)
        (broken / "lumigraph.json").write_text("{")
        with self.assertRaises(lg.CorruptInput) as corrupt:
            lg.open_scene(broken)
        self.assertIn("lumigraph.json", corrupt.exception.file)
        with self.assertRaises(lg.UsageError):
            lg.open(scenes.desk(), settings={"k": 99})
        with self.assertRaisesRegex(lg.UsageError, "not a setting"):
            lg.open(scenes.desk(), settings={"kk": 1})
        with self.assertRaises(lg.UsageError):
            lg.open(scenes.desk(), proxy="none-of-that-name")

    def test_a_programs_failure_is_an_exception(self):
        with self.assertRaises(lg.UsageError) as refused:
            lg.run("lumi-render", scenes.desk(), holdout=1)
        self.assertIn("holdout", str(refused.exception))
        with self.assertRaises(lg.MachineError):
            lg.run("lumi-none-of-that-name")

    def test_progress_is_told_and_may_stop_the_work(self):
        told = []
        lg.evaluate(scenes.desk(), holdout=4, progress=lambda *report: told.append(report))
        self.assertTrue(told)
        self.assertTrue(all(len(report) == 5 for report in told))

        class Enough(Exception):
            pass

        def stop(*_):
            raise Enough

        with self.assertRaises(Enough):
            lg.evaluate(scenes.desk(), holdout=2, progress=stop)
        # In the last report of all as well.
        calls = []

        def stop_at_the_end(*report):
            calls.append(report)
            if len(calls) == len(told):
                raise Enough

        told.clear()
        lg.open_scene(scenes.desk(), progress=lambda *report: told.append(report))
        if told:
            with self.assertRaises(Enough):
                lg.open_scene(scenes.desk(), progress=stop_at_the_end)
        stopped = scenes.scratch() / "stopped"
        with self.assertRaises(Enough):
            lg.run("lumi-render", scenes.desk(), "-o", stopped, seconds=30, progress=stop)
        alive = [p for p in pathlib.Path("/proc").glob("[0-9]*/cmdline") if str(stopped) in self.words(p)]
        self.assertFalse(alive)

    @staticmethod
    def words(cmdline):
        try:
            return cmdline.read_bytes().decode(errors="replace")
        except OSError:
            return ""

    def test_names_may_be_any_bytes(self):
        odd = scenes.scratch() / "odd"
        (odd / "images").mkdir(parents=True)
        name = os.fsdecode(b"caf\xe9 1.jpg")
        scene = lg.open_scene(scenes.desk())
        cameras = []
        for j in range(4):
            os.symlink(scene.photo_file(j), odd / "images" / (name if j == 0 else f"{j}.jpg"))
            R, t = scene.cam_from_world[j][:, :3], scene.cam_from_world[j][:, 3]
            cameras.append((name if j == 0 else f"{j}.jpg", R, t, scene.K[j]))
        sparse = odd / "sparse"
        sparse.mkdir()
        width, height = scene.size_px[0]
        K = cameras[0][3]
        (sparse / "cameras.txt").write_text(f"1 PINHOLE {width} {height} {K[0, 0]} {K[1, 1]} {K[0, 2]} {K[1, 2]}\n")
        (sparse / "points3D.txt").write_text("1 0 0 0 9 9 9 0.5\n")
        lines = []
        for i, (photo, R, t, _) in enumerate(cameras, 1):
            w = np.sqrt(max(0, 1 + np.trace(R))) / 2
            x, y, z = (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]) / (4 * w)
            lines.append(f"{i} {w} {x} {y} {z} {t[0]} {t[1]} {t[2]} 1 {photo}\n\n")
        (sparse / "images.txt").write_bytes(os.fsencode("".join(lines)))
        opened = lg.open_scene(odd)
        self.assertIn(name, opened.names)
        self.assertEqual(opened.read_photo(name).shape[2], 3)
        self.assertEqual(opened.view(name).size_px, (width, height))
        with self.assertRaisesRegex(lg.UsageError, "no photo"):
            opened.view(name + "x")

    def test_options_as_on_a_line(self):
        self.assertEqual(lg.options(faces=500, keep_hull=True, name=None, holes=False, merge=["a", "b"]),
                         ["--faces", "500", "--keep-hull", "--merge", "a", "--merge", "b"])


class Stubs(unittest.TestCase):
    def test_the_stub_names_what_there_is(self):
        from lumigraph import _core

        stub = ast.parse((pathlib.Path(lg.__file__).parent / "_core.pyi").read_text())

        def named(body):
            names = set()
            for node in body:
                if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                    names.add(node.name)
                elif isinstance(node, ast.AnnAssign):
                    names.add(node.target.id)
            return names

        def public(thing):
            # pybind11 adds some of its own.
            return {n for n in dir(thing) if not n.startswith("__") and "pybind11" not in n}

        self.assertEqual({n for n in named(stub.body) if not n.startswith("__")}, public(_core))
        for node in stub.body:
            if isinstance(node, ast.ClassDef):
                mine = {n for n in named(node.body) if not n.startswith("__")}
                self.assertEqual(mine, public(getattr(_core, node.name)), node.name)

    def test_what_is_offered_is_documented(self):
        for name in lg.__all__:
            if name not in ("__version__", "ProgressCallback"):
                self.assertTrue(getattr(lg, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
