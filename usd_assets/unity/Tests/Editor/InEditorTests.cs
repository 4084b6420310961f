// SPDX-License-Identifier: Apache-2.0
using System;
using System.Linq;
using NUnit.Framework;
using StereoCell.Editor;
using UnityEditor;
using UnityEngine;
using Object = UnityEngine.Object;

namespace StereoCell.Tests
{
    /// <summary>
    /// Tests that need the editor. The first checks that the editor's compilers accept the shader. The second checks that
    /// surfaces from glTFast lie inside the volumes; it needs the environment variable STEREOCELL_BUNDLE, a bundle's
    /// folder.
    /// </summary>
    public sealed class InEditorTests
    {
        const string Target = "Assets/StereoCell test.stereocell";

        [Test]
        public void TheShaderCompiles()
        {
            var shader = Shader.Find("StereoCell/Volume");
            Assert.IsTrue(shader != null, "the shader is not in the project");
            Assert.IsFalse(ShaderUtil.ShaderHasError(shader), "the shader has errors: see its Inspector");
            Assert.IsTrue(shader.isSupported, "this GPU does not support the shader");
        }

        [Test]
        public void SurfacesLieInTheirVolumes()
        {
            var bundle = Environment.GetEnvironmentVariable("STEREOCELL_BUNDLE");
            if (string.IsNullOrEmpty(bundle)) Assert.Ignore("STEREOCELL_BUNDLE is not set to the folder of a bundle");
            GameObject made = null;
            try
            {
                made = (GameObject)PrefabUtility.InstantiatePrefab(BundleMenu.Link(bundle, Target));
                var tiles = made.GetComponentsInChildren<Tile>(true);
                Assert.IsTrue(tiles.Length > 0, "there are no tiles");
                foreach (var tile in tiles)
                {
                    tile.Show(true, true);
                    Assert.IsTrue(tile.ShowsVolume, tile.name + ": its voxels were not loaded");
                    var boxes = tile.volume.GetComponentsInChildren<Renderer>().Select(renderer => renderer.bounds).ToArray();
                    if (boxes.Length == 0) continue;
                    var whole = boxes[0];
                    foreach (var box in boxes) whole.Encapsulate(box);
                    whole.Expand(0.02f * whole.size.magnitude);
                    foreach (var surface in tile.surfaces.GetComponentsInChildren<Renderer>(true))
                    {
                        var inside = whole.Contains(surface.bounds.min) && whole.Contains(surface.bounds.max);
                        Assert.IsTrue(inside, tile.name + ": " + surface.name + " lies outside its volume");
                    }
                }
            }
            finally
            {
                if (made != null) Object.DestroyImmediate(made);
                AssetDatabase.DeleteAsset(Target);
            }
        }
    }
}
