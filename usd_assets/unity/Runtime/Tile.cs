// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace StereoCell
{
    /// <summary>A spatial tile, shown by its surfaces, by its volume, or by both.</summary>
    [DisallowMultipleComponent, AddComponentMenu("StereoCell/Tile")]
    public sealed class Tile : MonoBehaviour
    {
        public GameObject surfaces;
        public GameObject volume;

        public bool ShowsVolume
        {
            get { return volume != null && volume.activeSelf; }
        }

        public void Show(bool withSurfaces, bool withVolume)
        {
            if (surfaces != null) surfaces.SetActive(withSurfaces);
            if (volume != null) volume.SetActive(withVolume);
        }

        /// <summary>From surfaces to the volume, and back.</summary>
        [ContextMenu("Switch between surfaces and volume")]
        public void Switch()
        {
            Show(ShowsVolume, !ShowsVolume);
        }
    }
}
