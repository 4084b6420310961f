// SPDX-License-Identifier: Apache-2.0
using System;
using System.Linq;
using System.Text;
using GLTFast;
using Newtonsoft.Json.Linq;
using UnityEngine;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    /// <summary>The objects that glTFast makes of a surface's file.</summary>
    sealed class Surface
    {
        public GameObject Made;
        public Texture2D[] Textures;

        /// <summary>The JSON of the file's materials, so that equal materials can be shared; null if the file has
        /// images.</summary>
        public string MaterialText;

        /// <exception cref="BundleException">glTFast can't read the file.</exception>
        public static Surface Read(string path, byte[] data)
        {
            var settings = new ImportSettings { NodeNameMethod = NameImportMethod.OriginalUnique, GenerateMipMaps = true };
            var gltf = new GltfImport(null, new UninterruptedDeferAgent());
            var holder = new GameObject("surface");
            var isRead = RunHere.ToEnd(() => gltf.Load(data, null, settings)) && RunHere.ToEnd(() => gltf.InstantiateMainSceneAsync(holder.transform));
            if (!isRead)
            {
                Object.DestroyImmediate(holder);
                throw new BundleException(path + " was not imported. Check that glTFast and meshoptimizer decompression are in the project.");
            }
            var made = holder;
            if (holder.transform.childCount == 1)
            {
                made = holder.transform.GetChild(0).gameObject;
                made.transform.SetParent(null, false);
                Object.DestroyImmediate(holder);
            }
            var textures = Enumerable.Range(0, gltf.TextureCount).Select(i => gltf.GetTexture(i)).Where(texture => texture != null);
            var surface = new Surface { Made = made, Textures = textures.Distinct().ToArray(), MaterialText = MaterialsOf(data) };
            gltf.DisposeRequiredForInstantiationData();
            return surface;
        }

        static string MaterialsOf(byte[] glb)
        {
            const int headBytes = 20;  // headers of the file and of its first chunk, which is JSON
            if (glb.Length < headBytes) return null;
            var json = JObject.Parse(Encoding.UTF8.GetString(glb, headBytes, BitConverter.ToInt32(glb, 12)));
            return json["textures"] == null && json["materials"] != null ? json["materials"].ToString() : null;
        }
    }
}
