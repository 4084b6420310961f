// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell
{
    /// <summary>
    /// Changes the imported colour of surfaces. In play mode, the renderers of a channel share a copy of their material,
    /// which the scriptable pipelines can batch. In the editor, they get a property block, so that no asset and no scene
    /// is changed.
    /// </summary>
    sealed class SurfaceColors
    {
        static readonly int BaseColor = Shader.PropertyToID("baseColorFactor");  // a property of glTFast's materials

        readonly Dictionary<Renderer, Material> imported = new Dictionary<Renderer, Material>();
        readonly Dictionary<KeyValuePair<Channel, Material>, Material> copies = new Dictionary<KeyValuePair<Channel, Material>, Material>();
        MaterialPropertyBlock block;

        public void Apply(Renderer renderer, Channel channel)
        {
            var isImported = channel.color == channel.importedColor;
            if (Application.isPlaying)
            {
                renderer.sharedMaterial = isImported ? Original(renderer) : Copy(renderer, channel);
                renderer.SetPropertyBlock(null);
            }
            else if (isImported) renderer.SetPropertyBlock(null);
            else
            {
                if (block == null) block = new MaterialPropertyBlock();
                block.SetColor(BaseColor, channel.color);  // Unity converts it to linear
                renderer.SetPropertyBlock(block);
            }
        }

        public void Destroy()
        {
            foreach (var copy in copies.Values) VolumeTexture.Discard(copy);
            copies.Clear();
        }

        Material Original(Renderer renderer)
        {
            Material found;
            if (!imported.TryGetValue(renderer, out found)) imported.Add(renderer, found = renderer.sharedMaterial);
            return found;
        }

        Material Copy(Renderer renderer, Channel channel)
        {
            var original = Original(renderer);
            if (original == null) return null;
            Material copy;
            var key = new KeyValuePair<Channel, Material>(channel, original);
            if (!copies.TryGetValue(key, out copy)) copies.Add(key, copy = new Material(original));
            copy.SetColor(BaseColor, channel.color);
            return copy;
        }
    }
}
