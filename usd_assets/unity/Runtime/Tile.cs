// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell
{
    /// <summary>A spatial tile that shows its surfaces, its volume, or both. The voxels are loaded when the volume is
    /// first requested. The tile keeps its surfaces until the volume is complete.</summary>
    [DisallowMultipleComponent, AddComponentMenu("StereoCell/Tile")]
    public sealed class Tile : MonoBehaviour
    {
        public GameObject surfaces;
        public GameObject volume;

        VolumeBox[] boxes;
        bool keepsSurfaces;

        public bool ShowsVolume
        {
            get { return volume != null && volume.activeSelf; }
        }

        /// <summary>Whether the tile's voxels are being loaded.</summary>
        public bool IsLoading { get; private set; }

        /// <summary>0 to 1. The share of the visible channels' voxels that is loaded.</summary>
        public float Progress
        {
            get
            {
                float sum = 0, count = 0;
                foreach (var box in Boxes())
                {
                    if (!box.IsShown) continue;
                    sum += box.Progress;
                    count++;
                }
                return count == 0 ? 1 : sum / count;
            }
        }

        /// <summary>Bytes. The peak memory of the tile's voxels, which is reached during loading.</summary>
        public long PeakBytes
        {
            get
            {
                var sizes = new List<KeyValuePair<int[], int>>();
                foreach (var box in Boxes()) sizes.Add(new KeyValuePair<int[], int>(box.size, box.channels.Length));
                return VolumeMemory.PeakBytes(sizes);
            }
        }

        public void Show(bool withSurfaces, bool withVolume)
        {
            var specimen = GetComponentInParent<Specimen>(true);
            IsLoading = withVolume && volume != null && specimen != null;
            keepsSurfaces = withSurfaces;
            if (!IsLoading)
            {
                if (surfaces != null) surfaces.SetActive(withSurfaces);
                if (volume != null) volume.SetActive(withVolume);
                return;
            }
            specimen.Load(this);
        }

        /// <summary>Switch from surfaces to the volume, or back.</summary>
        [ContextMenu("Switch between surfaces and volume")]
        public void Switch()
        {
            var hides = ShowsVolume || IsLoading;
            Show(hides, !hides);
        }

        /// <summary>Continue loading, and show the volume when it is complete. The specimen calls this in each
        /// frame.</summary>
        public void Advance(long mostBytes)
        {
            foreach (var box in Boxes())
            {
                if (box.IsShown && !box.Advance(mostBytes)) return;
            }
            if (!IsLoading) return;
            IsLoading = false;
            volume.SetActive(true);
            if (surfaces != null) surfaces.SetActive(keepsSurfaces);
        }

        /// <summary>Free the voxels' memory and show the surfaces.</summary>
        public void Unload()
        {
            IsLoading = false;
            foreach (var box in Boxes()) box.Unload();
            if (volume != null) volume.SetActive(false);
            if (surfaces != null) surfaces.SetActive(true);
        }

        VolumeBox[] Boxes()
        {
            if (boxes == null) boxes = volume == null ? new VolumeBox[0] : volume.GetComponentsInChildren<VolumeBox>(true);
            return boxes;
        }
    }
}
